#pragma once

#include <opencv2/core.hpp>

namespace semvslam {

struct MaskFitOptions {
  int band_px = 10;           // the outline may move by so much; 0 = it stays
  double tolerance_m = 0.25;  // pixels of the band whose depth is that near to the thing's belong to it
  int reach_px = 48;          // side of the window over which the thing's depth is averaged
};

/// Moves the outline of masks to where the depth image has it: a network's outlines are off by some pixels, so corners
/// on the seam of a jacket would be kept, and corners on the wall beside it dropped. Works at half the resolution.
/// Pixels without depth stay as they were, and so does everything farther than the band from the outline.
/// @param mask CV_8UC1, 255 = thing; changed in place. @param depth CV_16UC1 or CV_32FC1 of the same size, may be
/// empty: then nothing changes. @param metres_per_unit of a 16-bit depth.
void fit_to_depth(cv::Mat& mask, const cv::Mat& depth, float metres_per_unit, const MaskFitOptions& options);

/// Sets every pixel that is at most `reach_px` rows and columns from one that is set. @param mask CV_8UC1, changed in
/// place; may be all zero.
void grow_mask(cv::Mat& mask, int reach_px);

/// Sets in `target` what grow_mask() would set in a copy of `mask`, which may be empty. Both CV_8UC1 of one size.
void add_grown(cv::Mat& target, const cv::Mat& mask, int reach_px);

/// The mask without its pixels that are at most `rim_px` rows and columns from one that is not set; beyond the image's
/// border it goes on. @param mask CV_8UC1. @param inside gets it; CV_8UC1 of the mask's size, must not be the mask.
void without_rim(const cv::Mat& mask, int rim_px, cv::Mat& inside);

}  // namespace semvslam
