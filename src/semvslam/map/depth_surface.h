#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "semvslam/geometry/camera.h"

namespace semvslam {

/// What a depth image says of a point that should be seen at a pixel.
enum class SurfaceCheck {
  kUnknown,      // no measurement there, or an edge of depth nearby
  kFits,         // the surface lies where the point is
  kHidden,       // something nearer stands before it
  kSeenThrough,  // only things farther away are seen: what carried the point is gone
};

/// Compares a point with the surface measured around its pixel (5x5 pixels, so that edges of depth and a pose that is
/// off by a pixel decide nothing).
/// @param depth CV_16UC1 or CV_32FC1 (see RgbdFrame), may be empty. @param pixel ideal (undistorted).
SurfaceCheck check_surface(const Camera& camera, const cv::Mat& depth, const Eigen::Vector2d& pixel, double depth_m);

}  // namespace semvslam
