#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace semvslam {

/// A FAST corner on its own level.
struct Corner {
  std::uint16_t x = 0, y = 0;
  std::uint16_t score = 0;  // the highest threshold at which the pixel is still a corner
};

/// FAST-9 corners (Rosten, Drummond, ECCV 2006): nine neighbouring pixels of the ring of 16 are all brighter than the
/// centre by more than the threshold, or all darker. The score of every pixel is computed without a branch, many pixels
/// at once; that is faster than an early way out as soon as the threshold is low enough for noise to pass it.
class FastDetector {
 public:
  /// Corners of which no direct neighbour has a higher score (equal ones: the first in reading order stays), in reading
  /// order.
  /// @param border no corner is nearer to the image's border than this many pixels; at least 4.
  /// @param threshold grey levels, at least 1.
  void detect(const cv::Mat& image, int border, int threshold, std::vector<Corner>& out);

 private:
  std::vector<Corner> found_;       // longer than what was found: a row is written without asking for room
  std::vector<std::uint8_t> rows_;  // scores of three rows, then marks of one row
};

}  // namespace semvslam
