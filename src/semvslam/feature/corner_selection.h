#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "semvslam/feature/fast_corners.h"

namespace semvslam {

/// Thins corners so that they cover the image and the strong ones stay. Keeps its buffers between calls.
class CornerSelector {
 public:
  /// @param cell_px side of the square cells that corners are spread over, at least 1.
  explicit CornerSelector(int cell_px) : cell_px_(cell_px), inverse_cell_(1.f / static_cast<float>(cell_px)) {}

  /// In every cell that holds a corner of score >= threshold, drops the weaker ones; other cells keep all they have.
  /// The order of the corners stays.
  void drop_weak(std::vector<Corner>& corners, int width_px, int height_px, int threshold);

  /// The best min(wanted, all) corners in the order of `corners`, and behind them up to `spare` more, best first.
  ///
  /// Cells compete for the budget like parties for seats (D'Hondt's divisors): the k-th strongest corner of its cell
  /// (k = 1, 2, ...) counts score / k, and those that count most are taken. So a textured cell gets its best corners
  /// before a strong cell gets its many; an isolated corner that is hardly above the noise does not push out a good
  /// one; and however concentrated the texture is, the whole budget is used. One pass, no search for a radius of
  /// suppression. Equal counts: the stronger, then the earlier in `corners`.
  /// @param out overwritten.
  void select(std::span<const Corner> corners, int width_px, int height_px, int wanted, int spare,
              std::vector<Corner>& out);

 private:
  struct Candidate {
    float count;
    std::uint32_t rank;   // by score, in the whole image
    std::uint32_t index;  // into corners
  };
  void set_size(int width_px, int height_px);
  std::size_t cell_of(const Corner& c) const;
  void rank_by_score(std::span<const Corner> corners);

  int cell_px_;
  float inverse_cell_;
  std::size_t columns_ = 0, cells_ = 0;
  std::vector<std::uint8_t> strong_cell_, chosen_;
  std::vector<std::uint32_t> bucket_, sorted_, in_cell_;
  std::vector<Candidate> candidates_;
};

}  // namespace semvslam
