#pragma once

#include <cstddef>
#include <span>

#include "semvslam/semantic/detection_boxes.h"

namespace semvslam {

/// One level of the feature pyramid, channels last: data[(y * columns + x) * channels + c].
struct FeatureMap {
  const float* data = nullptr;
  int rows = 0, columns = 0, stride = 1;
  const float* pixel(int y, int x, int channels) const {
    return data + (static_cast<std::ptrdiff_t>(y) * columns + x) * channels;
  }
};

/// Which level a box is read from: the number of thresholds that sqrt(area) reaches.
int roi_level(const DetectionBox& box, std::span<const float> thresholds);

/// The features under a box as cells x cells x channels numbers. Each cell is the mean of 2x2 samples, read bilinearly;
/// half a pixel is taken off the coordinates (torchvision's roi_align with aligned=True, sampling_ratio=2).
void roi_align(const FeatureMap& map, int channels, const DetectionBox& box, int cells, float* out);

}  // namespace semvslam
