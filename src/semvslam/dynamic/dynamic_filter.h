#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/data/frame.h"
#include "semvslam/dynamic/dynamic_record.h"
#include "semvslam/dynamic/mask_fit.h"
#include "semvslam/motion/motion_detector.h"
#include "semvslam/semantic/segmentation_repair.h"

namespace semvslam {

struct DynamicOptions {
  std::string masks = "off";  // off; boxes: whole boxes of instances of dynamic classes; masks: their pixels
  bool motion = false;        // motion consistency
  MaskFitOptions fit;         // of the masks' outlines to the depth image
  /// An outline is that broad inwards and outwards: it may be off, and the descriptor of a corner on it sees both
  /// sides. No landmark comes from there.
  int dilate_px = 4;
  /// A feature that no motion test was made for and that hangs on something that moves may be a limb that the mask
  /// lacks: no landmark may come from it. Along the surface; an arm or a leg is that long; 0 = off.
  double reach_m = 0.6;
  double rest_reach_m = 0.2;    // the same for tested ones: a limb may be at rest while the rest moves. A foot, a hand
  int least_features = 60;      // with depth; with fewer the filter opens
  double movable_share = 0.4;   // of the points of an instance of a movable class that move: it is moving
  int movable_points = 4;       // that must move at least
  double movable_hold_s = 1.0;  // it counts as moving for that long after it stopped
  /// An instance of a dynamic class none of whose parts has moved for that long counts as static until it moves; 0 =
  /// never. For people who sit or sleep and fill the picture; needs motion consistency.
  double rest_after_s = 0;
  RepairOptions restoration;  // of missed segmentations
  MotionOptions motion_options;

  void add_to(ConfigSchema& schema);
  /// Errors of the parts' options that single values cannot show.
  Status check() const;
  bool needs_segmentation() const { return masks != "off"; }
};

/// The one policy on what may move: puts segmentation, its restoration and motion consistency together and says of
/// every feature whether it may be used, and of every pixel whether it belongs to the static scene (paper,
/// sections 2.2, 2.4, 2.5). Per frame, in this order: begin, judge, end. One thread.
class DynamicFilter {
 public:
  /// @param options must pass check().
  DynamicFilter(const Camera& camera, const DynamicOptions& options);
  ~DynamicFilter();

  /// @param segmentation of this frame, or a late one (its `frame` says of which); null = none.
  /// @param cur_from_prev expected motion of the camera since the last frame.
  void begin(const RgbdFrame& frame, const Segmentation* segmentation, const std::optional<SE3>& cur_from_prev);
  /// CV_8UC1, non-zero where no features shall be extracted: masks, and where what moved in the last frame should be
  /// now; empty = everywhere.
  const cv::Mat& excluded() const;
  /// Opens what is excluded when too few features were found outside: first what moved in the last frame, then the
  /// instances with the least scores. @return whether excluded() has changed.
  bool relax(int features_with_depth);

  /// Verdicts on the features found outside excluded(). @param pixels recorded. @param depths_m as many, 0 = unknown.
  /// @return per feature its FeatureUse.
  const std::vector<std::uint8_t>& judge(std::span<const cv::Point2f> pixels, std::span<const float> depths_m);

  /// @param camera_from_world what tracking found; empty = lost. @param tracked per feature that judge() left: a
  /// landmark was found at it.
  void end(const std::optional<SE3>& camera_from_world, std::span<const std::uint8_t> tracked);
  /// Motion consistency from the next frame on, whatever the options said.
  void use_motion();
  /// Poses from before and after cannot be compared: the map was corrected in between.
  void forget_poses();

  /// Of the frame between begin and the next begin.
  std::shared_ptr<const DynamicRecord> record() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace semvslam
