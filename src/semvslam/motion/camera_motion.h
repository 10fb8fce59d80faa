#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// One point seen in two frames. Ideal pixels; depth 0 = not measured.
struct PointPair {
  Eigen::Vector2d from_px = Eigen::Vector2d::Zero(), to_px = Eigen::Vector2d::Zero();
  double from_depth_m = 0, to_depth_m = 0;
  double weight = 1;  // of its vote; 0 = not asked
};

enum class CameraMotionSource : std::uint8_t {
  kNone,       // could not be found
  kGiven,      // by the caller
  kEstimated,  // from the tracks
  kPredicted,  // the hint: the tracks gave nothing better
};
std::string_view to_string(CameraMotionSource source);

struct CameraMotionOptions {
  std::uint64_t seed = 1;
  int min_points = 12;     // that must agree
  int cell_px = 80;        // votes are counted per cell of the image, so that a big thing with many points has few
  double inlier_px = 1.5;  // reprojection error of a pair that agrees
  double depth_sigma_per_m2 = 0.002;
  double depth_bias_share = 0.005;
  double prediction_sigma_m = 0.008, prediction_sigma_rad = 0.008;  // how far from the hint counts against a hypothesis
  int max_iterations = 120;

  void add_to(ConfigSchema& schema);
};

struct CameraMotion {
  CameraMotionSource source = CameraMotionSource::kNone;
  SE3 cur_from_prev;
  int points = 0;        // pairs that agree
  double support = 0;    // share of the cells with pairs that agree
  double runner_up = 0;  // support of the best clearly different motion: near `support`, the choice was a close one
};

/// The camera's motion between two frames from points that mostly stand still: rigid RANSAC over pairs with depth,
/// hypotheses scored by the number of image cells that agree and by closeness to the hint, then least squares on the
/// pairs that agree. @param hint expected motion, if any.
CameraMotion estimate_camera_motion(std::span<const PointPair> pairs, const Camera& camera,
                                    const std::optional<SE3>& hint, const CameraMotionOptions& options);

}  // namespace semvslam
