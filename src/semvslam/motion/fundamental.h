#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "semvslam/base/config_schema.h"

namespace semvslam {

/// Whether epipolar lines say anything about these pairs.
enum class FundamentalState : std::uint8_t {
  kUsable,
  kTooFewPairs,  // fewer than FundamentalOptions::min_pairs
  kNoConsensus,  // no matrix that enough pairs agree with
  kStill,        // the pairs hardly moved: any line through the points fits
  kHomography,   // rotation alone or a plane: a homography explains the pairs as well, F is arbitrary
};
std::string_view to_string(FundamentalState state);

struct FundamentalOptions {
  std::uint64_t seed = 1;
  int min_pairs = 20;
  double inlier_px = 1.0;              // Sampson distance
  double still_px = 1.5;               // median displacement below which the camera counts as still
  double max_homography_share = 0.85;  // of F's inliers that may agree with one homography too
  int max_iterations = 200;

  void add_to(ConfigSchema& schema);
};

struct FundamentalEstimate {
  FundamentalState state = FundamentalState::kTooFewPairs;
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();  // pixel_b^T F pixel_a = 0
  std::vector<std::uint8_t> inlier;                  // per pair; empty where there is no matrix
  int inliers = 0;
  double homography_share = 0;  // of the inliers
  double median_motion_px = 0;
  bool usable() const { return state == FundamentalState::kUsable; }
};

/// F by RANSAC over the normalised eight-point method, refined on all inliers, and the verdict on whether it means
/// anything (paper section 2.4; degeneracy: Torr, Fitzgibbon, Zisserman, The problem of degeneracy in structure and
/// motion recovery, IJCV 1999). @param pixels_a, pixels_b ideal pixels, paired by index, static scene mostly.
FundamentalEstimate estimate_fundamental(std::span<const Eigen::Vector2d> pixels_a,
                                         std::span<const Eigen::Vector2d> pixels_b, const FundamentalOptions& options);

}  // namespace semvslam
