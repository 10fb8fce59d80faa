#pragma once

#include <opencv2/core.hpp>

namespace semvslam {

/// Sets every pixel that is at most `reach_px` rows and columns from one that is set. @param mask CV_8UC1, changed in
/// place; may be all zero.
void grow_mask(cv::Mat& mask, int reach_px);

/// Sets in `target` what grow_mask() would set in a copy of `mask`, which may be empty. Both CV_8UC1 of one size.
void add_grown(cv::Mat& target, const cv::Mat& mask, int reach_px);

/// The mask without its pixels that are at most `rim_px` rows and columns from one that is not set; beyond the image's
/// border it goes on. @param mask CV_8UC1. @param inside gets it; CV_8UC1 of the mask's size, must not be the mask.
void without_rim(const cv::Mat& mask, int rim_px, cv::Mat& inside);

}  // namespace semvslam
