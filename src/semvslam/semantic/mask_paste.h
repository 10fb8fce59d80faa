#pragma once

#include <opencv2/core.hpp>

#include "semvslam/semantic/detection_boxes.h"

namespace semvslam {

/// A mask in the part of an image that it covers.
struct PastedMask {
  cv::Rect window;  // inside the image; empty when the box is
  cv::Mat mask;     // CV_8UC1, 255 = inside
};

/// Stretches side x side probabilities over a box: bilinear, zero beyond the outermost cells, inside where >= 0.5.
PastedMask paste_mask(const float* probabilities, int side, const DetectionBox& box, cv::Size image);

}  // namespace semvslam
