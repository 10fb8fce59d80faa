#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace semvslam {

/// A fixed grid over an image that answers "which points lie within r of (x, y)" in time proportional to the answer.
/// Storage is one contiguous index vector (counting sort), rebuilt per image without allocation once warm.
class ImageGrid {
 public:
  /// @param x_px,y_px of one length; point i is known as index i. @param width_px,height_px at least 1 (else the grid
  /// is empty).
  /// @param cell_px side of a cell, at least 1; points outside [0, width) x [0, height) are clamped into the border
  /// cells.
  void build(std::span<const float> x_px, std::span<const float> y_px, int width_px, int height_px, int cell_px = 20);

  /// Calls f(index) for every point with |dx| <= radius_px and |dy| <= radius_px, in ascending cell order
  /// (row by row), within a cell in ascending index order. A negative or NaN radius finds nothing.
  template <typename F>
  void for_each_near(float x_px, float y_px, float radius_px, F&& f) const;

 private:
  // Clamped before the conversion: a float beyond int has no defined integer value. NaN goes to cell 0 and is never
  // found.
  int cell_of(float v, int cells) const {
    const float c = v * inverse_cell_;
    return c >= 1.f ? (c < static_cast<float>(cells) ? static_cast<int>(c) : cells - 1) : 0;
  }
  float inverse_cell_ = 1.f;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> cell_begin_;
  std::vector<std::uint32_t> indices_;
  std::vector<float> x_, y_;  // in the order of indices_
  std::vector<std::uint32_t> cell_of_point_;
};

template <typename F>
void ImageGrid::for_each_near(float x_px, float y_px, float radius_px, F&& f) const {
  if (columns_ == 0) return;
  const int c0 = cell_of(x_px - radius_px, columns_), c1 = cell_of(x_px + radius_px, columns_);
  const int r0 = cell_of(y_px - radius_px, rows_), r1 = cell_of(y_px + radius_px, rows_);
  for (int r = r0; r <= r1; ++r) {
    const std::uint32_t begin = cell_begin_[static_cast<std::size_t>(r * columns_ + c0)];
    const std::uint32_t end = cell_begin_[static_cast<std::size_t>(r * columns_ + c1 + 1)];
    for (std::uint32_t k = begin; k < end; ++k) {
      const float dx = x_[k] - x_px, dy = y_[k] - y_px;
      if (dx <= radius_px && -dx <= radius_px && dy <= radius_px && -dy <= radius_px) f(indices_[k]);
    }
  }
}

}  // namespace semvslam
