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

  /// Finds the points with |dx| <= radius_px and |dy| <= radius_px: in ascending cell order (row by row), within a cell
  /// in ascending index order. A negative or NaN radius finds nothing. No branch depends on a point: about half of
  /// those in the cells lie in the square, and guessing which costs more than looking at all.
  /// @param out their indices, at its front; has room for size() of them, else throws std::invalid_argument.
  /// @return how many.
  std::size_t find_near(float x_px, float y_px, float radius_px, std::span<std::uint32_t> out) const;

  /// Points of the image.
  std::size_t size() const { return indices_.size(); }

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

}  // namespace semvslam
