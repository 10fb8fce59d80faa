#pragma once

#include <opencv2/core.hpp>

#include "semvslam/feature/flow_pyramid.h"

namespace semvslam {

struct LucasKanadeOptions {
  static constexpr int kLargestWindowPx = 41;

  int window_px = 15;          // side of the patch that is followed (odd), at most kLargestWindowPx
  int levels = 3;              // of the pyramids above the image, at most; fewer where they have fewer
  int max_iterations = 12;     // per level
  double epsilon_px = 0.03;    // a step as short ends the search on a level
  double least_texture = 0.1;  // smaller eigenvalue of the patch's mean g g^T, (grey levels / px)^2
};

/// Follows a point by the method of Lucas and Kanade (1981) from coarse to fine (Bouguet, 2000): the shift that
/// minimizes the sum of squared differences of two patches, by Gauss-Newton steps with the gradient of the first patch
/// (as Baker and Matthews, 2004, for a mere shift), so that gradients and normal matrix are made once per level.
///
/// The steps are cheap because the second patch is interpolated bilinearly: as long as it stays between the same four
/// pixels, the right side of the equations is a blend of four sums, made once from whole pixels. These sums are of
/// integers, exact in any order; the result is the same on every machine.
///
/// @param from, to pyramids built for this window. @param at in the first image, px. @param found in: where the search
/// starts in the second image; out: where it ended. @return whether it was found: inside the image (or not farther
/// outside than half the window), with enough texture.
bool follow_point(const FlowPyramid& from, const FlowPyramid& to, cv::Point2f at, const LucasKanadeOptions& options,
                  cv::Point2f& found);

/// Mean of g g^T around a pixel: (xx, xy, yy) in (grey levels / px)^2, g by Scharr's filter over whole pixels.
/// @param radius_px of the square, 1..7. @return as cv::Vec3f
cv::Vec3f mean_texture(const FlowPyramid& pyramid, cv::Point pixel, int radius_px);

/// Mean absolute difference in grey levels of the patches around two points, which may lie between pixels, inside the
/// images. @param without_offset less the difference of their means, as of exposure. @param window_px side, at most
/// that of the pyramids.
float patch_difference(const FlowPyramid& a, cv::Point2f at_a, const FlowPyramid& b, cv::Point2f at_b, int window_px,
                       bool without_offset);

}  // namespace semvslam
