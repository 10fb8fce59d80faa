#include "semvslam/feature/corner_selection.h"

#include <algorithm>

namespace semvslam {

void CornerSelector::set_size(int width_px, int height_px) {
  columns_ = static_cast<std::size_t>((width_px + cell_px_ - 1) / cell_px_);
  cells_ = columns_ * static_cast<std::size_t>((height_px + cell_px_ - 1) / cell_px_);
}

std::size_t CornerSelector::cell_of(const Corner& c) const {
  // Half a pixel away from every border of a cell, so that the product cannot round over it.
  const auto column = static_cast<std::size_t>((static_cast<float>(c.x) + 0.5f) * inverse_cell_);
  const auto row = static_cast<std::size_t>((static_cast<float>(c.y) + 0.5f) * inverse_cell_);
  return row * columns_ + column;
}

void CornerSelector::drop_weak(std::vector<Corner>& corners, int width_px, int height_px, int threshold) {
  set_size(width_px, height_px);
  strong_cell_.assign(cells_, 0);
  for (const Corner& c : corners) {
    if (c.score >= threshold) strong_cell_[cell_of(c)] = 1;
  }
  std::erase_if(corners, [&](const Corner& c) { return c.score < threshold && strong_cell_[cell_of(c)]; });
}

/// Stable counting sort of the indices, strongest first, into sorted_.
void CornerSelector::rank_by_score(std::span<const Corner> corners) {
  std::uint32_t top = 0;
  for (const Corner& c : corners) top = std::max<std::uint32_t>(top, c.score);
  bucket_.assign(top + 2, 0);
  for (const Corner& c : corners) ++bucket_[top - c.score + 1];
  for (std::size_t i = 1; i < bucket_.size(); ++i) bucket_[i] += bucket_[i - 1];
  sorted_.resize(corners.size());
  for (std::uint32_t i = 0; i < corners.size(); ++i) sorted_[bucket_[top - corners[i].score]++] = i;
}

void CornerSelector::select(std::span<const Corner> corners, int width_px, int height_px, int wanted, int spare,
                            std::vector<Corner>& out) {
  out.clear();
  if (wanted <= 0) return;
  if (corners.size() <= static_cast<std::size_t>(wanted)) {
    out.assign(corners.begin(), corners.end());
    return;
  }
  set_size(width_px, height_px);
  rank_by_score(corners);
  in_cell_.assign(cells_, 0);
  candidates_.resize(corners.size());
  for (std::uint32_t rank = 0; rank < sorted_.size(); ++rank) {
    const Corner& c = corners[sorted_[rank]];
    const std::uint32_t k = ++in_cell_[cell_of(c)];
    candidates_[rank] = {static_cast<float>(c.score) / static_cast<float>(k), rank, sorted_[rank]};
  }
  const auto better = [](const Candidate& a, const Candidate& b) {
    return a.count != b.count ? a.count > b.count : a.rank < b.rank;
  };
  const auto last_wanted = candidates_.begin() + wanted;
  std::nth_element(candidates_.begin(), last_wanted, candidates_.end(), better);
  chosen_.assign(corners.size(), 0);
  for (auto it = candidates_.begin(); it != last_wanted; ++it) chosen_[it->index] = 1;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (chosen_[i]) out.push_back(corners[i]);
  }
  const auto last_spare = last_wanted + std::min<std::ptrdiff_t>(spare, candidates_.end() - last_wanted);
  std::partial_sort(last_wanted, last_spare, candidates_.end(), better);
  for (auto it = last_wanted; it != last_spare; ++it) out.push_back(corners[it->index]);
}

}  // namespace semvslam
