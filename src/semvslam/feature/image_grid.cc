#include "semvslam/feature/image_grid.h"

#include <cmath>
#include <stdexcept>

namespace semvslam {

void ImageGrid::build(std::span<const float> x_px, std::span<const float> y_px, int width_px, int height_px,
                      int cell_px) {
  if (x_px.size() != y_px.size()) throw std::invalid_argument("ImageGrid::build: x_px and y_px differ in length");
  if (cell_px < 1) throw std::invalid_argument("ImageGrid::build: cell_px must be at least 1");
  inverse_cell_ = 1.f / static_cast<float>(cell_px);
  if (width_px < 1 || height_px < 1) {
    columns_ = rows_ = 0;
    indices_.clear();
    return;
  }
  columns_ = (width_px + cell_px - 1) / cell_px;
  rows_ = (height_px + cell_px - 1) / cell_px;

  // Counting sort: count per cell, running sum, place. Two slots ahead, so that placing turns sums into begins by
  // itself.
  const std::size_t cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  const std::size_t n = x_px.size();
  cell_begin_.assign(cells + 2, 0);
  cell_of_point_.resize(n);
  indices_.resize(n);
  x_.resize(n);
  y_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const int cell = cell_of(y_px[i], rows_) * columns_ + cell_of(x_px[i], columns_);
    cell_of_point_[i] = static_cast<std::uint32_t>(cell);
    ++cell_begin_[static_cast<std::size_t>(cell) + 2];
  }
  for (std::size_t c = 2; c < cells + 2; ++c) cell_begin_[c] += cell_begin_[c - 1];
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t k = cell_begin_[cell_of_point_[i] + 1]++;
    indices_[k] = static_cast<std::uint32_t>(i);
    x_[k] = x_px[i];
    y_[k] = y_px[i];
  }
}

std::size_t ImageGrid::find_near(float x_px, float y_px, float radius_px, std::span<std::uint32_t> out) const {
  if (out.size() < size()) throw std::invalid_argument("ImageGrid::find_near: no room for all points");
  std::size_t found = 0;
  if (columns_ == 0) return found;
  const int c0 = cell_of(x_px - radius_px, columns_), c1 = cell_of(x_px + radius_px, columns_);
  const int r0 = cell_of(y_px - radius_px, rows_), r1 = cell_of(y_px + radius_px, rows_);
  for (int r = r0; r <= r1; ++r) {
    const std::uint32_t begin = cell_begin_[static_cast<std::size_t>(r * columns_ + c0)];
    const std::uint32_t end = cell_begin_[static_cast<std::size_t>(r * columns_ + c1 + 1)];
    for (std::uint32_t k = begin; k < end; ++k) {
      const float dx = std::abs(x_[k] - x_px), dy = std::abs(y_[k] - y_px);
      out[found] = indices_[k];  // not beyond its end: each point is visited at most once
      found += static_cast<std::size_t>((dx <= radius_px) & (dy <= radius_px));
    }
  }
  return found;
}

}  // namespace semvslam
