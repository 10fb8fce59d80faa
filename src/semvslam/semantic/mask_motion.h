#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/semantic/mask_carry.h"

namespace semvslam {

/// How the pixels of one object move from one frame into another. All in pixels of half the image's size.
struct MaskMotion {
  static constexpr int kCell = 16;  // distance of two nodes of the field

  cv::Rect window;           // of the object in the target frame, with room around it; clipped to the image
  cv::Mat_<cv::Vec2f> back;  // node (x, y) lies at window.tl() + kCell * (x, y): source minus target position
  cv::Point2f shift;         // median, target minus source
  float depth_change_m = 0;
  int flow_points = 0;  // 0: from the pose or the guess
};

/// An object in half resolution.
struct HalfMask {
  cv::Rect window;
  cv::Mat mask;  // CV_8UC1 of the window's size
  int pixels = 0;
};

/// Every second pixel of a mask in full resolution.
HalfMask half_mask(const cv::Rect& window, const cv::Mat& mask);

/// @param guess of the motion, half px, where no pose is known or LK fails.
MaskMotion estimate_motion(const Camera& camera, const MaskCarryOptions& options, const CarryFrame& from,
                           const CarryFrame& to, const HalfMask& object, const std::optional<SE3>& to_from,
                           cv::Point2f guess);

}  // namespace semvslam
