#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/geometry/ransac.h"
#include "semvslam/solve/pose_optimizer.h"

namespace semvslam {

/// The at most four poses from which three known points are seen in three directions. Grunert's system in the ratios of
/// the distances (Haralick et al., Review and analysis of solutions of the three point perspective pose estimation
/// problem, IJCV 1994), its quartic solved by the companion matrix, each solution polished on the three distance
/// equations.
/// @param directions unit vectors in the camera frame. @param points_in_world metres.
/// @param camera_from_world solutions are appended; none for degenerate input (points on a line, equal directions,
/// NaN).
void solve_p3p(const std::array<Eigen::Vector3d, 3>& directions, const std::array<Eigen::Vector3d, 3>& points_in_world,
               std::vector<SE3>& camera_from_world);

struct PnpOptions {
  RansacOptions ransac{.seed = 1, .confidence = 0.999, .min_iterations = 10, .max_iterations = 300};
  double chi2_pixel = 5.991;
  int min_inliers = 10;  // fewer: an error
  PoseOptimizerOptions refinement;
};

struct PnpEstimate {
  PoseEstimate pose;
  std::vector<std::uint8_t> inlier;  // 1 per match that agrees with the refined pose
  int iterations = 0;                // of RANSAC
};

/// Pose of a camera from matches between known points and its image, without a first guess: P3P in RANSAC, then
/// optimize_pose() on all matches (which uses depths where there are some). Deterministic for a seed.
/// @param points_in_world one per observation. Matches that are not finite are left out.
/// Errors: fewer than 4 usable matches; no pose that min_inliers matches agree with.
Result<PnpEstimate> estimate_pose(const Intrinsics& camera, std::span<const Eigen::Vector3d> points_in_world,
                                  std::span<const PointObservation> observations, const PnpOptions& options = {});

}  // namespace semvslam
