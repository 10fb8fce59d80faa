#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/feature/flow_pyramid.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

struct MaskCarryOptions {
  std::string motion = "flow";     // flow (LK inside the mask, started with the pose), pose (pose and depth), none
  int points = 80;                 // LK points per instance
  double depth_tolerance_m = 0.2;  // how far a pixel's depth may be from the one carried to it
  int grow_px = 4;                 // how far connected pixels of fitting depth are taken in
  double least_support = 0.4;      // share of the carried pixels that must fit the present depth, else it is not there
  double least_inside = 0.15;      // share of the carried pixels that must lie in the image, else it has left

  void add_to(ConfigSchema& schema);
};

/// The images of one moment, with what is computed from them once and on demand. Cheap to copy: the images are shared.
class CarryFrame {
 public:
  static constexpr int kFlowWindowPx = 15, kFlowLevels = 3;  // of LK, in the half-size image

  CarryFrame() = default;
  /// @param gray CV_8UC1 or empty. @param depth CV_16UC1 or CV_32FC1 (see RgbdFrame) or empty.
  CarryFrame(const Camera& camera, cv::Mat gray, cv::Mat depth);

  const cv::Mat& gray() const { return gray_; }
  cv::Size half_size() const { return {(size_.width + 1) / 2, (size_.height + 1) / 2}; }
  /// CV_32FC1, m, half the width and height (every second pixel); 0 = none. Empty where there is no depth.
  const cv::Mat& half_depth_m() const;
  /// Of the half-size image; empty where there is no gray image.
  const FlowPyramid& pyramid() const;

 private:
  struct Cache;
  cv::Mat gray_, depth_;
  cv::Size size_;
  float metres_per_unit_ = 0;
  std::shared_ptr<Cache> cache_;
};

/// What became of a mask on its way into another frame.
enum class CarryOutcome {
  kVisible,   // most of it is still there
  kOccluded,  // most of it lies behind something nearer
  kLeft,      // most of it lies outside the image
  kGone,      // the place is seen and something farther is there
};

std::string_view to_string(CarryOutcome outcome);

struct CarriedMask {
  cv::Rect window;  // px, inside the image; empty = nothing left
  cv::Mat mask;     // CV_8UC1 of the window's size, 255 = object
  CarryOutcome outcome = CarryOutcome::kGone;
  cv::Point2f shift_px;      // median motion of the mask
  float depth_change_m = 0;  // median change of depth along the motion
  float support = 0;         // share of the carried pixels that the present depth agrees with; 1 without depth
  float occluded = 0;        // share of the carried pixels that lie behind something nearer
  float inside = 0;          // share of the carried pixels that lie in the image
  int flow_points = 0;       // LK points that the motion rests on; 0 = pose or nothing
};

/// Carries the mask of one object from one frame into another: motion by LK inside the mask (robust, locally varying),
/// pose and depth where that fails; then keeps the pixels whose depth fits the carried one and grows into connected
/// pixels of fitting depth. Works on half the resolution, the result is refined at full resolution.
class MaskCarry {
 public:
  MaskCarry(const Camera& camera, const MaskCarryOptions& options);

  /// @param window, mask of the object in `from`, as in Instance. @param to_from camera motion between the two frames.
  /// @param guess_px motion of the mask to start from where no pose is known.
  /// Without gray images the pose or the guess alone moves it; without depth nothing is cut off or grown.
  CarriedMask carry(const CarryFrame& from, const CarryFrame& to, const cv::Rect& window, const cv::Mat& mask,
                    const std::optional<SE3>& to_from, cv::Point2f guess_px = {}) const;

 private:
  Camera camera_;
  MaskCarryOptions options_;
};

}  // namespace semvslam
