#pragma once

#include <Eigen/Core>

#include "semvslam/geometry/camera.h"

namespace semvslam {

/// The numbers of a camera that residuals need. Lens distortion is gone before: observations are ideal pixels.
struct Intrinsics {
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  double focal_baseline_px_m = 0;  // f b: disparity_px = focal_baseline_px_m / depth_m

  static Intrinsics of(const Camera& c) { return {c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.fx_px * c.baseline_m}; }
};

/// A landmark seen in an image. The pixel and the depth are separate measurements with separate noise and separate
/// robust losses: at the edge of an object the depth is often wrong where the pixel is right. Residual 1 (px): pixel -
/// project(camera_from_world * point).  Residual 2 (px of disparity): disparity_px - f b / z.
struct PointObservation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // ideal (undistorted) pixel
  double disparity_px = -1;                         // f b / measured depth; <= 0: depth unknown
  double inverse_variance_px = 1;                   // 1 / px^2, both axes
  double inverse_variance_disparity = 1;            // 1 / px^2
};

}  // namespace semvslam
