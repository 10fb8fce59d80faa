#pragma once

#include <array>
#include <span>
#include <vector>

#include "semvslam/motion/flow_tracks.h"
#include "semvslam/motion/motion_check.h"
#include "semvslam/motion/moving_regions.h"

namespace semvslam {

/// All options of motion detection; keys `motion.*`.
struct MotionOptions {
  FlowTrackOptions flow;
  FundamentalOptions fundamental;
  CameraMotionOptions camera;
  MotionCheckOptions check;
  MovingRegionOptions regions;

  void add_to(ConfigSchema& schema);
};

/// What one frame's motion detection found.
struct MotionResult {
  FrameId frame;
  MotionCheckResult check;               // entry i: track i of MotionDetector::tracks()
  std::array<int, kTrackLosses> lost{};  // by TrackLoss
  cv::Mat mask;  // CV_8UC1 of the image's size, 255 = unknown moving object. Never written to later
  std::vector<MovingRegion> regions;
  double flow_ms = 0, check_ms = 0, regions_ms = 0;
};

/// Verdict on a point that is no track itself.
struct PointVerdict {
  MotionVerdict verdict = MotionVerdict::kUnknown;
  bool sure = false;  // it is the track's own surface: a few pixels from it and as deep
};

/// Motion consistency of one camera stream, all parts together: tracks, verdicts, regions. Frames in order, one thread.
class MotionDetector {
 public:
  MotionDetector(const Camera& camera, const MotionOptions& options);

  MotionResult step(const MotionFrame& frame);
  /// The part of step() that needs the frame's images and cur_from_prev alone, half of its time: may be done
  /// beforehand, by another thread as long as nothing else is called.
  void follow(const MotionFrame& frame);
  const std::vector<FlowTrack>& tracks() const { return tracks_.tracks(); }

  /// Poses that tracking found after step(): see MotionCheck. They need not be given.
  void set_pose(FrameId frame, const SE3& camera_from_world) { check_.set_pose(frame, camera_from_world); }
  void forget_poses() { check_.forget_poses(); }

  /// Verdicts for points of the last frame that are no tracks themselves (features): as the nearest track within 12 px
  /// whose depth is alike; else unknown. Regions are not asked.
  /// @param pixels recorded. @param depths_m as many, 0 = not measured. @param verdicts is resized.
  void judge(std::span<const cv::Point2f> pixels, std::span<const float> depths_m,
             std::vector<PointVerdict>& verdicts) const;

 private:
  Camera camera_;
  FlowTracks tracks_;
  MotionCheck check_;
  MovingRegions regions_;
  MotionResult last_;
  double followed_ms_ = 0;
};

}  // namespace semvslam
