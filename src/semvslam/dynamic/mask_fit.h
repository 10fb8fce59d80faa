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

}  // namespace semvslam
