#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/base/result.h"
#include "semvslam/base/stage_timer.h"
#include "semvslam/base/time_stamp.h"
#include "semvslam/data/frame.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/pipeline/config.h"
#include "semvslam/tracking/messages.h"

namespace semvslam {

/// Where the mask that a frame was tracked with came from.
enum class MaskSource { kNone, kGiven };

/// What is known about a frame the moment it has been tracked. Mapping may improve the pose later: see
/// Slam::trajectory().
struct TrackResult {
  FrameId frame;
  TimeStamp stamp;
  TrackingState state = TrackingState::kInitializing;
  SE3 world_from_camera;  // metres; world = camera of the first key frame. While lost: the last known pose
  int inliers = 0;        // landmarks that agree with the pose
  bool is_key_frame = false;
  MaskSource mask_source = MaskSource::kNone;
  double tracking_ms = 0;  // frame in to pose out
};

struct SlamStatistics {
  std::uint64_t frames = 0, tracked = 0, lost = 0;
  std::uint64_t key_frames = 0, landmarks = 0;
  std::vector<StageSummary> stages;
};

/// Receives what happens; called on the thread of process().
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void on_frame(const RgbdFrame& frame, const TrackResult& result) = 0;
};

/// The whole system. Feed frames in the order of their stamps; ask for the trajectory at any time; finish() at the end.
/// process() and finish() belong to one thread; the queries may be called from any.
class Slam {
 public:
  /// @return an Error for a camera that fails Camera::check().
  static Result<std::unique_ptr<Slam>> create(const Config& config, const Camera& camera);
  ~Slam();

  /// Tracks one frame. Image sizes must be the camera's: anything else is an Error and the frame is not used.
  Result<TrackResult> process(const RgbdFrame& frame);
  void add_sink(std::shared_ptr<Sink> sink);
  /// Waits until mapping has worked off what it was given, then adjusts the whole map once more
  /// (mapping.final_bundles); further calls do nothing. @return what went wrong in any stage.
  Status finish();

  /// Poses (world_from_camera) of all tracked frames with everything that mapping has learnt since, by time.
  Trajectory trajectory() const;
  Trajectory key_frame_trajectory() const;
  /// Positions of all landmarks, world frame, metres.
  std::vector<Eigen::Vector3d> landmark_positions() const;
  SlamStatistics statistics() const;
  const Config& effective_config() const;
  /// See Map::check_invariants().
  Status check_invariants() const;

 private:
  struct Impl;
  explicit Slam(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace semvslam
