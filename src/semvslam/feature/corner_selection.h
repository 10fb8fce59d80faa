#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace semvslam {

/// A FAST corner on its own level.
struct Corner {
  std::uint16_t x = 0, y = 0;
  std::uint16_t score = 0;  // the highest threshold at which the pixel is still a corner
};

/// Thins corners so that they cover the image evenly and the strong ones stay. Keeps its buffers between calls.
class CornerSelector {
 public:
  /// In every cell that holds a corner of score >= threshold, drops the weaker ones; other cells keep all they have.
  /// The order of the corners stays.
  void drop_weak(std::vector<Corner>& corners, int width_px, int height_px, int cell_px, int threshold);

  /// At most `wanted` corners, exactly that many when there are as many. Strongest first, a corner is taken when no
  /// taken one lies within a distance d (in x and in y); d is the largest that yields enough. Non-maximal suppression
  /// with an adaptive radius (Brown et al., CVPR 2005), as one search over the radius (Bailo et al., Pattern
  /// Recognition Letters 2018). However concentrated the texture is, the budget is used. Equal scores: the order of
  /// `corners` decides.
  /// @param out overwritten, strongest first.
  void select(std::span<const Corner> corners, int width_px, int height_px, int wanted, std::vector<Corner>& out);

 private:
  int take(int distance_px, int width_px, int height_px, int enough);

  std::vector<std::uint8_t> strong_cell_;
  std::vector<Corner> sorted_;
  std::vector<std::uint32_t> bucket_;
  std::vector<std::uint32_t> cell_;  // one taken corner per cell, + 1; 0 = none
  std::vector<std::uint32_t> taken_, best_;
};

}  // namespace semvslam
