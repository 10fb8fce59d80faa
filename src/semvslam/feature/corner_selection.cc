#include "semvslam/feature/corner_selection.h"

#include <algorithm>
#include <cstdlib>

namespace semvslam {

void CornerSelector::drop_weak(std::vector<Corner>& corners, int width_px, int height_px, int cell_px, int threshold) {
  const int columns = (width_px + cell_px - 1) / cell_px, rows = (height_px + cell_px - 1) / cell_px;
  const auto cell_of = [&](const Corner& c) {
    return static_cast<std::size_t>(c.y / cell_px * columns + c.x / cell_px);
  };
  strong_cell_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  for (const Corner& c : corners) {
    if (c.score >= threshold) strong_cell_[cell_of(c)] = 1;
  }
  std::erase_if(corners, [&](const Corner& c) { return c.score < threshold && strong_cell_[cell_of(c)]; });
}

void CornerSelector::select(std::span<const Corner> corners, int width_px, int height_px, int wanted,
                            std::vector<Corner>& out) {
  out.clear();
  if (wanted <= 0 || corners.empty()) return;

  // Stable counting sort, strongest first.
  std::uint32_t top = 0;
  for (const Corner& c : corners) top = std::max<std::uint32_t>(top, c.score);
  bucket_.assign(top + 2, 0);
  for (const Corner& c : corners) ++bucket_[top - c.score + 1];
  for (std::size_t i = 1; i < bucket_.size(); ++i) bucket_[i] += bucket_[i - 1];
  sorted_.resize(corners.size());
  for (const Corner& c : corners) sorted_[bucket_[top - c.score]++] = c;

  if (corners.size() <= static_cast<std::size_t>(wanted)) {
    out = sorted_;
    return;
  }
  int low = 1, high = std::max(width_px, height_px) + 1;  // low yields enough: distinct pixels are 1 apart
  best_.clear();
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    if (take(middle, width_px, height_px, wanted) >= wanted) {
      low = middle;
      best_.swap(taken_);
    } else {
      high = middle;
    }
  }
  if (best_.empty()) {
    out.assign(sorted_.begin(), sorted_.begin() + wanted);
    return;
  }
  for (const std::uint32_t i : best_) out.push_back(sorted_[i]);
}

/// Greedy choice with all pairs at least distance_px apart in x or in y; stops at `enough`. Two points of one cell of
/// that side are always nearer, so a cell holds at most one and nine cells tell all.
int CornerSelector::take(int distance_px, int width_px, int height_px, int enough) {
  const int columns = width_px / distance_px + 3, rows = height_px / distance_px + 3;  // a rim of empty cells
  cell_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  taken_.clear();
  for (std::uint32_t i = 0; i < sorted_.size(); ++i) {
    const Corner& c = sorted_[i];
    const int column = c.x / distance_px + 1, row = c.y / distance_px + 1;
    bool free = true;
    for (int r = row - 1; r <= row + 1 && free; ++r) {
      for (int k = column - 1; k <= column + 1; ++k) {
        const std::uint32_t other = cell_[static_cast<std::size_t>(r * columns + k)];
        if (other == 0) continue;
        const Corner& o = sorted_[other - 1];
        if (std::abs(o.x - c.x) < distance_px && std::abs(o.y - c.y) < distance_px) {
          free = false;
          break;
        }
      }
    }
    if (!free) continue;
    cell_[static_cast<std::size_t>(row * columns + column)] = i + 1;
    taken_.push_back(i);
    if (static_cast<int>(taken_.size()) >= enough) break;
  }
  return static_cast<int>(taken_.size());
}

}  // namespace semvslam
