#pragma once

#include <array>
#include <span>
#include <vector>

namespace semvslam {

/// Corners in pixels; a pixel's centre is at +0.5.
struct DetectionBox {
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  float width() const { return x1 - x0; }
  float height() const { return y1 - y0; }
  /// Where it lies in an image that was scaled by x and y to become the one it is in.
  DetectionBox unscaled(float x, float y) const { return {x0 / x, y0 / y, x1 / x, y1 / y}; }
  /// @param share of the width and of the height that is added on each side.
  DetectionBox grown(float share) const {
    return {x0 - share * width(), y0 - share * height(), x1 + share * width(), y1 + share * height()};
  }
};

/// The anchors of one pyramid level, cell by cell, sizes within a cell, ratios (height / width) within a size.
std::vector<DetectionBox> make_anchors(int rows, int columns, int stride, std::span<const float> sizes,
                                       std::span<const float> ratios);

/// A box from its reference and the network's four numbers, clipped to width x height.
/// @param weights what the numbers are divided by.
DetectionBox decode_box(const float* deltas, const DetectionBox& reference, const std::array<float, 4>& weights,
                        float width, float height);

/// Indices of the boxes that stay, best first, at most `most`: a box goes when a better one overlaps it with
/// intersection / union above the threshold. Equal scores: the earlier one is better. Scores must be finite.
std::vector<int> suppress_overlaps(std::span<const DetectionBox> boxes, std::span<const float> scores, float threshold,
                                   int most);

/// Indices of the `most` largest values, largest first; equal values: lower index first. Values must be finite.
std::vector<int> largest(std::span<const float> values, int most);

}  // namespace semvslam
