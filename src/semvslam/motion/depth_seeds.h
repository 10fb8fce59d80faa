#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/motion/motion_check.h"

namespace semvslam {

/// A place of the present image where there is a surface in what was empty space some frames ago.
struct DepthSeed {
  cv::Point pixel;
  float depth_m = 0;
};

/// Finds surfaces that moved into view of things seen before, without any texture: a measured point is carried back
/// into an earlier frame by the camera's motion; where that frame looked through it to something clearly farther away,
/// the point has arrived since.
class DepthSeeds {
 public:
  DepthSeeds(const Camera& camera, const MotionCheckOptions& options, int step_px);

  /// @param depth of this frame, shared and not written to later. @param cur_from_prev the camera's motion since the
  /// frame before; absent = unknown, the frames before are forgotten.
  const std::vector<DepthSeed>& step(const cv::Mat& depth, const std::optional<SE3>& cur_from_prev);
  void reset() { past_.clear(); }

 private:
  struct Past {
    cv::Mat depth;
    SE3 past_from_cur;
  };
  /// @param point in the camera frame of that depth image
  bool was_empty(const cv::Mat& past_depth, const Eigen::Vector3d& point) const;

  Camera camera_;
  bool bent_;  // by the lens
  MotionCheckOptions options_;
  struct Place {
    cv::Point pixel;
    Eigen::Vector3d ray;  // z = 1, without lens distortion
  };
  std::vector<Place> raster_;
  std::deque<Past> past_;  // oldest first
  std::vector<DepthSeed> seeds_;
};

}  // namespace semvslam
