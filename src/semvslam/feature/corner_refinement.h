#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>

namespace semvslam {

/// A corner moved to the nearby peak of Harris' score.
struct RefinedCorner {
  int x = 0, y = 0;            // pixel of the peak
  float dx_px = 0, dy_px = 0;  // from there to the peak between the pixels, within half a pixel and a bit
};

/// How far a corner may be moved, in pixels of its level.
constexpr int kRefineReach = 3;
/// Pixels around a corner that are looked at.
constexpr int kRefineMargin = 9;

/// FAST answers anywhere near a corner, and where exactly changes with noise and with the position between the pixels;
/// the peak of a smooth score does not. Climbs from (x, y) to the highest score of Harris and Stephens (AVC 1988; 5x5
/// window, k = 0.04), at most kRefineReach steps, and puts a paraboloid through the 3x3 scores there.
/// @param inside pixels that the corner may be moved to; (x, y) is one of them, each is kRefineMargin - kRefineReach
/// from
///        the border of the image or more, (x, y) kRefineMargin.
RefinedCorner refine_corner(const cv::Mat& image, int x, int y, const cv::Rect& inside);

}  // namespace semvslam
