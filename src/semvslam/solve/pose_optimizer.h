#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "semvslam/geometry/se3.h"
#include "semvslam/solve/observation.h"

namespace semvslam {

struct PoseOptimizerOptions {
  int rounds = 4;                 // of inlier / outlier reclassification
  int iterations_per_round = 10;  // Gauss-Newton / LM steps at most (converged earlier: stops)
  double chi2_pixel = 5.991;      // 95 % of chi^2 with 2 degrees of freedom
  double chi2_disparity = 3.841;  // 95 % with 1
};

struct PoseEstimate {
  SE3 camera_from_world;
  int inliers = 0;
  double mean_squared_error = 0;  // weighted pixel chi^2 per inlier
  // Of the left increment (rho, phi), at the solution.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Motion-only bundle adjustment: the pose that explains where known points are seen (ORB-SLAM2, section III-C, with
/// the depth as a separate residual). Levenberg-Marquardt on Huber losses; every observation is re-classified after
/// each round, pixel and depth apart: one with a wrong depth goes on as a pixel alone.
/// @param points_in_world one per observation, metres. Pairs that are not finite, or have no positive weight, are left
/// out.
/// @param inlier resized; 1 where the pixel residual passes chi2_pixel (and z > 0).
/// Never fails: with fewer than 3 usable observations or a singular system (fewer than 6 directions observed) it
/// returns `initial` and 0 inliers.
PoseEstimate optimize_pose(const Intrinsics& camera, const SE3& initial,
                           std::span<const Eigen::Vector3d> points_in_world,
                           std::span<const PointObservation> observations, const PoseOptimizerOptions& options,
                           std::vector<std::uint8_t>& inlier);

}  // namespace semvslam
