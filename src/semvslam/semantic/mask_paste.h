#pragma once

#include <opencv2/core.hpp>

#include "semvslam/semantic/detection_boxes.h"

namespace semvslam {

/// A mask in the part of an image that it covers.
struct PastedMask {
  cv::Rect window;      // inside the image; empty when the box is
  cv::Mat mask;         // CV_8UC1, 255 = inside
  float certainty = 0;  // mean probability of the mask's pixels; 0 without any
};

/// A coarse map of the probability that a pixel belongs to the object's kind, and how much it counts.
struct SemanticHint {
  const float* data = nullptr;  // of cell (x, y): data[(y * columns + x) * step]
  int rows = 0, columns = 0, step = 1;
  float cells_per_px_x = 0, cells_per_px_y = 0;
  float share = 0;  // 0 = the mask alone, 1 = the hint alone
};

/// Stretches side x side probabilities over a box: bilinear, zero beyond the outermost cells; mixed with the hint where
/// there is one; inside where >= threshold.
PastedMask paste_mask(const float* probabilities, int side, const DetectionBox& box, cv::Size image,
                      float threshold = 0.5f, const SemanticHint* hint = nullptr);

}  // namespace semvslam
