#pragma once

#include <opencv2/core.hpp>
#include <span>

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

/// side x side probabilities stretched over a box: bilinear, zero beyond the outermost cells.
struct MaskGrid {
  const float* probabilities = nullptr;
  int side = 0;
  DetectionBox box;
};

/// The grid's probabilities at the image's pixels, mixed with the hint where there is one; inside where >= threshold.
PastedMask paste_mask(const MaskGrid& grid, cv::Size image, float threshold = 0.5f, const SemanticHint* hint = nullptr);

/// The same probabilities at the centres of cells x cells equal parts of a region, row by row.
void sample_mask(const MaskGrid& grid, const DetectionBox& region, int cells, const SemanticHint* hint, float* out);

/// Mean of the probabilities that are >= threshold; 0 without any.
float mean_inside(std::span<const float> probabilities, float threshold);

/// Probabilities become logits, shifted so that 0 is at the threshold: where the mask's edge would be if it were
/// pasted.
void bend_logits(std::span<float> probabilities, float threshold);

}  // namespace semvslam
