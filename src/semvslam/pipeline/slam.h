#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/base/result.h"
#include "semvslam/base/stage_timer.h"
#include "semvslam/base/time_stamp.h"
#include "semvslam/data/frame.h"
#include "semvslam/dynamic/dynamic_record.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/mask_runs.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/map/map.h"
#include "semvslam/pipeline/config.h"
#include "semvslam/semantic/segmentation.h"
#include "semvslam/tracking/messages.h"

namespace semvslam {

/// What is known about a frame the moment it has been tracked. Mapping may improve the pose later: see
/// Slam::trajectory().
struct TrackResult {
  FrameId frame;
  TimeStamp stamp;
  TrackingState state = TrackingState::kInitializing;
  /// Metres; world = camera of the sub-map's first key frame, or the world of the saved map. While lost: the last known
  /// pose.
  SE3 world_from_camera;
  SubMapId sub_map{0};
  int inliers = 0;  // landmarks that agree with the pose
  bool is_key_frame = false;
  MaskSource mask_source = MaskSource::kNone;
  double tracking_ms = 0;                        // frame and mask in to pose out
  std::shared_ptr<const DynamicRecord> dynamic;  // what was taken for moving, and why
};

/// Sums over the DynamicRecords of a run.
struct DynamicTotals {
  std::array<std::uint64_t, 3> verdicts{};                    // features by FeatureVerdict
  std::array<std::uint64_t, kFeatureReasons> reasons{};       // features by FeatureReason
  std::array<std::uint64_t, kMotionReasons> track_reasons{};  // point tracks by MotionReason
  std::array<std::uint64_t, kMaskSources> mask_sources{};     // frames by MaskSource
  std::array<std::uint64_t, kFailOpens> fail_opens{};         // frames by FailOpen
  std::array<std::uint64_t, 3> segmentation_states{};         // frames by SegmentationState, where there was a mask
  std::uint64_t restored_instances = 0, extended_instances = 0, moving_instances = 0, moving_regions = 0;
  std::uint64_t mask_age_frames = 0;  // summed over the frames with a mask
  double masked_share = 0;            // of the image, summed over all frames

  void add(const DynamicRecord& record);
};

/// A part of the map with a world of its own.
struct SubMapStatistics {
  SubMapId sub_map{0};
  std::uint64_t tracked = 0;  // frames
  std::uint64_t key_frames = 0, landmarks = 0;
};

/// Its own SubMapStatistics are those of the main sub-map, which results are of: the saved map's, or without one that
/// with the most tracked frames (of equal ones the older).
struct SlamStatistics : SubMapStatistics {
  std::uint64_t frames = 0, lost = 0;
  std::vector<SubMapStatistics> apart;                        // the sub-maps that were not joined with it, by id
  std::uint64_t sub_maps_begun = 0, sub_maps_joined = 0;      // beside the one that the run began with
  std::uint64_t loaded_key_frames = 0, loaded_landmarks = 0;  // of the saved map that it began with, at the beginning
  std::uint64_t relocalised = 0;                              // times that a lost camera was found in the map
  std::uint64_t revisits = 0;  // times that drift since an earlier visit of a place was removed
  std::uint64_t loops = 0;     // the same, where the place was recognised by what it looks like alone
  DynamicTotals dynamic;
  std::vector<std::string> notices;  // what went wrong without ending the run, each once
  std::vector<StageSummary> stages;
};

/// A key frame and what moved in it.
struct KeyFrameMask {
  FrameId frame;
  TimeStamp stamp;
  MaskRuns moving;  // recorded pixels of what moves or may; set nowhere if nothing does
  /// What its own segmentation shows, the movers included; empty where it had none.
  std::optional<std::vector<ClassMask>> classes;
};

/// Receives what happens; called on the thread of process().
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void on_frame(const RgbdFrame& frame, const TrackResult& result) = 0;
  /// Something went wrong that the run survives: one line.
  virtual void on_notice(const std::string&) {}
  /// Something is worth telling: one line.
  virtual void on_event(const std::string&) {}
};

/// The whole system. Feed frames in the order of their stamps; ask for the trajectory at any time; finish() at the end.
/// process() and finish() belong to one thread; the queries may be called from any.
class Slam {
 public:
  /// A network that cannot be had is no Error: motion consistency takes its place, and a notice says so.
  /// @return an Error for a camera or a configuration that fails its check().
  static Result<std::unique_ptr<Slam>> create(const Config& config, const Camera& camera);
  /// Begins in a saved map (read_map()): frames are lost until one is found in it, then poses are in its world, and it
  /// grows; with mapping.frozen it stays as it is. Frames, stamps and trajectories are of this session alone.
  /// @return an Error too for a map without key frames, and where camera or pyramid are not those of the map.
  static Result<std::unique_ptr<Slam>> create(const Config& config, const Camera& camera, Map map);
  ~Slam();

  /// Tracks one frame. Image sizes must be the camera's, and its stamp later than that of the frame before: anything
  /// else is an Error and the frame is not used. Where the configuration wants masks the frame is segmented first, on
  /// this thread; with Config::realtime beside it, and the newest mask there is serves.
  Result<TrackResult> process(const RgbdFrame& frame);
  /// The same for a frame that segment() was called for before, on any thread.
  Result<TrackResult> process(const RgbdFrame& frame, std::optional<Segmentation> segmentation);
  /// Segments a frame, for callers that read ahead (SegmentAhead). Any number of threads; not with
  /// Config::realtime.
  std::optional<Segmentation> segment(const RgbdFrame& frame);
  void add_sink(std::shared_ptr<Sink> sink);
  /// Waits until mapping has worked off what it was given, then adjusts the whole map once more
  /// (mapping.final_bundles); further calls do nothing, and process() is an Error. @return what went wrong in any
  /// stage.
  Status finish();

  // A camera that is lost and nowhere in the map goes on in a sub-map, in a world of its own; when its place is
  // recognised, that becomes a part of the older one. Where a sub-map may be named, none means the main one (see
  // SlamStatistics), and one that is not there (any more) is empty.

  /// Writes the map to a file, for another session to begin in; after finish() with everything that was learnt. Errors:
  /// an empty map; mapping that failed; as write_map().
  Status save_map(const std::filesystem::path& path, std::optional<SubMapId> sub_map = {}) const;

  /// Poses (world_from_camera) of all frames tracked with everything that mapping has learnt since, by time.
  Trajectory trajectory(std::optional<SubMapId> sub_map = {}) const;
  /// Of the key frames of this session.
  Trajectory key_frame_trajectory(std::optional<SubMapId> sub_map = {}) const;
  /// What moved in each key frame, in the order of key_frame_trajectory(): its other pixels are the static scene's.
  std::vector<KeyFrameMask> key_frame_masks(std::optional<SubMapId> sub_map = {}) const;
  /// Positions of all landmarks, in the sub-map's world, metres.
  std::vector<Eigen::Vector3d> landmark_positions(std::optional<SubMapId> sub_map = {}) const;
  SlamStatistics statistics() const;
  const Config& effective_config() const;
  /// See Map::check_invariants().
  Status check_invariants() const;

 private:
  struct Impl;
  static Result<std::unique_ptr<Slam>> make(const Config& config, const Camera& camera, std::optional<Map> map);
  explicit Slam(std::unique_ptr<Impl> impl);
  Result<TrackResult> process_named(const RgbdFrame& frame, std::optional<Segmentation> segmentation);
  std::unique_ptr<Impl> impl_;
};

}  // namespace semvslam
