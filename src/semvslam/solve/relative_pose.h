#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/geometry/ransac.h"
#include "semvslam/solve/pose_optimizer.h"

namespace semvslam {

/// A landmark that two cameras know by their own means (depth, or their own part of the map).
struct MatchedPoint {
  Eigen::Vector3d in_a = Eigen::Vector3d::Zero(), in_b = Eigen::Vector3d::Zero();  // camera frames, metres
  PointObservation seen_by_a, seen_by_b;                                           // where each camera sees it
};

struct RelativePoseOptions {
  RansacOptions ransac{.seed = 1, .confidence = 0.999, .min_iterations = 10, .max_iterations = 300};
  double chi2_pixel = 9.210;  // 99 % of chi^2 with 2 degrees of freedom, in each image
  int min_inliers = 15;       // fewer: an error
  PoseOptimizerOptions refinement;
};

struct RelativePoseEstimate {
  SE3 a_from_b;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();  // of the left increment of a_from_b
  std::vector<std::uint8_t> inlier;  // 1 per match that fits in both images
  int inliers = 0, iterations = 0;
};

/// How two cameras with depth stand to each other: rigid alignment of three matched points in RANSAC, judged by the
/// projections into both images, then optimize_pose() in image a, and in the end the verdict again. Verifies loops and
/// re-localisation. Deterministic for a seed. Matches that are not finite are left out.
/// Errors: fewer than 3 usable matches; no motion that min_inliers matches agree with.
Result<RelativePoseEstimate> estimate_relative_pose(const Intrinsics& camera, std::span<const MatchedPoint> matches,
                                                    const RelativePoseOptions& options = {});

}  // namespace semvslam
