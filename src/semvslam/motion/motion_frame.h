#pragma once

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>

#include "semvslam/base/ids.h"
#include "semvslam/geometry/depth_image.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// One image with everything that motion detection may know about it. Only id and gray must be there.
struct MotionFrame {
  FrameId id;                            // greater than that of every frame before
  double time_s = 0;                     // in the caller's clock; differences give speeds and the time a region is kept
  cv::Mat gray;                          // CV_8UC1
  cv::Mat depth;                         // CV_16UC1 in camera units or CV_32FC1 in metres; empty = none
  std::optional<SE3> cur_from_prev;      // expected motion of the camera since the frame before, e.g. constant velocity
  std::optional<SE3> camera_from_world;  // pose of this frame where it is known well already; see MotionCheck
  std::span<const cv::Point2f> corners;  // recorded pixels to start tracks at (the caller's features), best first;
                                         // empty = corners are searched for
  cv::Mat excluded;   // CV_8UC1, non-zero = certainly moving class: no evidence about the camera; empty = none
  cv::Mat watched;    // CV_8UC1, non-zero = tracks are started there too, whatever is excluded and wherever the corners
                      // are, to see whether it moves; empty = none
  cv::Mat instances;  // CV_16UC1, 0 = none, n = instance n - 1 of a segmentation of this frame; empty = none
};

}  // namespace semvslam
