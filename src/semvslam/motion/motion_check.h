#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "semvslam/motion/camera_motion.h"
#include "semvslam/motion/flow_tracks.h"
#include "semvslam/motion/fundamental.h"

namespace semvslam {

enum class MotionVerdict : std::uint8_t { kUnknown, kStatic, kMoving };
std::string_view to_string(MotionVerdict verdict);

/// What a verdict rests on.
enum class MotionReason : std::uint8_t {
  kNone,          // static: every test that could be made agrees with the camera's motion
  kNew,           // unknown: the track is too short
  kNoEvidence,    // unknown: no depth and no usable epipolar line, or the tests are too weak to say anything
  kNoPose,        // unknown: the camera's motion could not be found
  kEpipolar,      // moving: off the epipolar line
  kReprojection,  // moving: not where its earlier position in space says
  kNearer,        // moving: nearer than expected
  kFarther,       // moving: farther away than expected
  kMemory,        // moving: nothing to see now, but it moved a moment ago
};
std::string_view to_string(MotionReason reason);

/// The verdict on one track with what was measured. Index as in the tracks given.
struct TrackMotion {
  PointTrackId id;
  MotionVerdict verdict = MotionVerdict::kUnknown;
  MotionReason reason = MotionReason::kNew;
  int baseline_frames = 0;        // age of the sample that position and depth were predicted from
  float epipolar_px = -1;         // D, eq. (4); -1 = not measured
  float reprojection_px = -1;     // |measured - predicted|; -1 = not measured
  float reprojection_sigmas = 0;  // the same in units of its standard deviation
  float depth_residual_m = 0;     // measured - predicted depth; 0 where not measured
  float depth_sigmas = 0;
  int moving_frames = 0;                                   // in a row up to now
  Eigen::Vector3f velocity_m_s = Eigen::Vector3f::Zero();  // in the present camera's axes, world at rest; 0 = unknown
};

struct MotionCheckOptions {
  double epipolar_px = 2.0;           // D above which a point moves
  double pixel_sigma_px = 0.5;        // of a tracked point, one coordinate
  double slip_share = 0.02;           // of the way it went: tracks slip a little
  double edge_slip_share = 0.08;      // the same where two depths meet: what is tracked there is no point of a surface
  double depth_sigma_per_m2 = 0.002;  // depth noise: sigma_z = this * z^2
  double depth_bias_share = 0.005;    // of z: errors of the depth that neighbours share (bent depth)
  double moving_sigmas = 4.5;         // residual above which a point moves
  double static_sigmas = 3.0;         // residual below which it is at rest
  double min_speed_m_s = 0.08;        // slower is at rest, whatever its residual
  int max_baseline_frames = 10;
  int memory_frames = 5;  // a moving track stays so for that long without evidence

  void add_to(ConfigSchema& schema);
};

struct MotionCheckResult {
  std::vector<TrackMotion> tracks;  // as the tracks given
  CameraMotion camera;              // cur_from_prev and where it comes from
  FundamentalEstimate fundamental;  // from the frame `fundamental_age` frames ago to this one
  int fundamental_age = 0;
  double noise_scale = 1;  // >= 1: by how much this frame's points scatter more than the options say (blur, shake)
  int moving = 0, at_rest = 0, unknown = 0;
};

/// Tells moving points from points at rest. Three tests: D > threshold against the epipolar line (the paper's); the
/// position predicted from an earlier sample's position, depth and the camera's motion, over the longest time held, so
/// that slow things are seen; measured against predicted depth, which sees motion along the epipolar line.
/// Keeps the camera's poses of the last frames and the memory of which tracks moved. One call per frame, in order.
class MotionCheck {
 public:
  MotionCheck(const Camera& camera, const MotionCheckOptions& options, const CameraMotionOptions& camera_options,
              const FundamentalOptions& fundamental_options);

  /// @param tracks as they stand after this frame. frame.camera_from_world is taken as the camera's pose if it is
  /// there; otherwise the motion since the frame before is estimated from the tracks outside frame.excluded, with
  /// frame.cur_from_prev as a hint.
  /// @param suspect CV_8UC1 in the frame before, non-zero = a thing that moved; tracks from there say little about the
  /// camera. Empty = none known.
  MotionCheckResult step(const MotionFrame& frame, std::span<const FlowTrack> tracks, const cv::Mat& suspect = {});

  /// Better poses for frames already seen, as tracking finds them; frames no longer held are ignored. All poses must be
  /// in one world: after a jump (loop closing, relocalisation) call forget_poses.
  void set_pose(FrameId frame, const SE3& camera_from_world);
  /// The poses held start anew with the next frame; the tracks' verdicts are remembered.
  void forget_poses();

 private:
  struct Pose {
    FrameId frame;
    SE3 camera_from_world;
    bool given = false;     // by the caller; the others were chained here
    bool doubtful = false;  // only predicted
  };
  struct Memory {
    int frames_since = 0;  // it was seen to move
    int in_a_row = 0;      // frames that it moved
  };
  const Pose* pose_of(FrameId frame) const;
  CameraMotion find_camera_motion(const MotionFrame& frame, std::span<const FlowTrack> tracks, const cv::Mat& suspect);
  void add_pose(const MotionFrame& frame, const CameraMotion& motion);
  FundamentalEstimate find_fundamental(std::span<const FlowTrack> tracks, int age) const;
  TrackMotion measure(const FlowTrack& track, const MotionCheckResult& result) const;
  void measure_on_segment(const TrackSample& then, const TrackSample& now, const SE3& now_from_then,
                          TrackMotion& motion) const;
  Eigen::Matrix2d pixel_covariance(const TrackSample& then, const TrackSample& now) const;
  void remember(std::span<const TrackMotion> motions);
  double noise_scale(std::span<const TrackMotion> motions, std::span<const FlowTrack> tracks) const;
  void decide(const FlowTrack& track, const MotionCheckResult& result, TrackMotion& motion) const;

  static constexpr double kMaxNoiseScale = 4;

  Camera camera_;
  MotionCheckOptions options_;
  CameraMotionOptions camera_options_;
  FundamentalOptions fundamental_options_;
  std::vector<Pose> poses_;  // oldest first
  std::unordered_map<PointTrackId, Memory> moved_;
};

}  // namespace semvslam
