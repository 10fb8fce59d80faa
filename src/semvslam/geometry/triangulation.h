#pragma once

#include <Eigen/Core>

#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// Why a point was not accepted.
enum class TriangulationVerdict {
  kGood,
  kNotFinite,     // an input is not a finite number
  kLowParallax,   // the rays are too parallel: the depth would be a guess
  kBehind,        // behind a camera, or out of the depth limits
  kReprojection,  // too far from a pixel in one of the images
};

struct TriangulationLimits {
  double min_parallax_rad = 0.02;  // angle between the rays, 1.15 degrees
  double min_depth_m = 0.05, max_depth_m = 1e3;
  double max_error_px = 2.45;  // in each image; sqrt of chi^2 5.991 at 1 px
};

struct Triangulation {
  TriangulationVerdict verdict = TriangulationVerdict::kNotFinite;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // valid when good or kReprojection
  double parallax_rad = 0;
  double error_a_px = 0, error_b_px = 0;  // distance of the ideal pixel from the projection
  bool good() const { return verdict == TriangulationVerdict::kGood; }
};

/// The point that two views saw: the midpoint of the shortest segment between the rays, then Gauss-Newton on the sum of
/// squared pixel errors, whose minimum is the maximum-likelihood one (Hartley and Sturm, Triangulation, CVIU 1997).
/// @param pixel_a, pixel_b ideal (undistorted) pixels. @param sigma_ratio_b standard deviation of pixel_b over that of
/// pixel_a; max_error_px holds for image a and is scaled by it for image b.
Triangulation triangulate(const Camera& camera_a, const SE3& a_from_world, const Eigen::Vector2d& pixel_a,
                          const Camera& camera_b, const SE3& b_from_world, const Eigen::Vector2d& pixel_b,
                          const TriangulationLimits& limits = {}, double sigma_ratio_b = 1.0);

/// Angle between the rays from two camera centres (world) to a point, radians in [0, pi].
double parallax_rad(const Eigen::Vector3d& point, const Eigen::Vector3d& centre_a, const Eigen::Vector3d& centre_b);

}  // namespace semvslam
