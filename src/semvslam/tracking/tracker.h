#pragma once

#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "semvslam/data/frame.h"
#include "semvslam/dynamic/dynamic_filter.h"
#include "semvslam/feature/matching.h"
#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/depth_surface.h"
#include "semvslam/map/landmark_view.h"
#include "semvslam/map/local_map.h"
#include "semvslam/solve/pose_optimizer.h"
#include "semvslam/tracking/messages.h"

namespace semvslam {

struct TrackingOptions {
  int min_initial_points = 150;    // features with depth that a first key frame needs
  int min_inliers = 20;            // fewer landmarks agreeing with the pose: lost
  double motion_radius_px = 15;    // search window of frame-to-frame matching, at level 0
  double local_map_radius_px = 4;  // search window of local-map matching, at level 0
  int max_distance_bits = 80;      // descriptors farther apart never match
  double min_view_cosine = 0.5;    // a landmark seen from a direction farther off is not searched
  double key_frame_ratio = 0.7;    // new key frame when fewer than this share of the reference's landmarks is tracked
  int min_tracked_close = 100;     // ... or fewer close landmarks than this are tracked while more than
  int min_new_close = 70;          // this many close features have none
  double close_depth_m = 3.5;
  int max_frames_between = 30;  // ... or so many frames have passed
  /// Not sooner than this, unless about to get lost: the window of key frames that mapping adjusts spans more time, and
  /// blurred frames in a row do not drift away on landmarks of their own.
  int min_frames_between = 3;
};

/// Milliseconds that one step spent, by part.
struct TrackingTimes {
  double extract_ms = 0;    // features, their depth
  double dynamic_ms = 0;    // restoration of masks, motion consistency
  double frame_ms = 0;      // pose from the previous frame
  double local_map_ms = 0;  // pose from the local map
  double total_ms = 0;
};

/// The camera's pose for every frame, from features matched to the previous frame and to the local map. Pure state
/// machine: no threads, no clock in any decision; the same calls give the same results.
class Tracker {
 public:
  struct Output {
    TrackingState state = TrackingState::kInitializing;
    SE3 camera_from_world;
    std::optional<RelativePose> relative;      // absent for a world's first key frame, and while lost
    int inliers = 0;                           // landmarks that agree with the pose
    std::optional<KeyFrameRequest> key_frame;  // present when this frame should be kept
    std::optional<LocalMapRequest> local_map;  // MapUse::kFollow: present when the camera has gone on
    std::optional<SearchRequest> search;       // present when it got lost and has features to be found by
    TrackingTimes times;
    std::shared_ptr<const DynamicRecord> dynamic;  // what was left out, and why
  };

  Tracker(const TrackingOptions& options, const OrbOptions& orb, const DynamicOptions& dynamic,
          std::shared_ptr<const ObservationModel> model, MapUse use = MapUse::kBuild);

  /// @param segmentation of this frame or of an earlier one; null = none.
  /// @param local the newest snapshot of the map; null before the first key frame has been mapped, or the first frame
  /// has been found in a map that was there before.
  /// @param may_request whether mapping would take a request now.
  /// @param may_begin whether a frame that is lost may begin a map anew, in a world of its own: then the next step()
  /// must get that one's snapshot.
  Output step(const RgbdFrame& frame, const Segmentation* segmentation, std::shared_ptr<const LocalMap> local,
              bool may_request, bool may_begin = false);

  /// Goes on from where a lost frame was found; the next step() must get found.local, or a newer one. @return false
  /// when tracking has found back by itself meanwhile: then nothing changes.
  bool resume(const FoundAgain& found);

  /// Motion consistency from now on: there will be no masks any more.
  void use_motion() { filter_.use_motion(); }

 private:
  struct Tracked {  // the frame that is being or was last tracked
    std::shared_ptr<FrameFeatures> features;
    std::vector<LandmarkId> landmarks;  // per feature
    SE3 camera_from_world;
  };
  struct Candidates {  // correspondences that the pose is estimated from
    std::vector<Eigen::Vector3d> points;
    std::vector<PointObservation> observations;
    std::vector<int> features;
    std::vector<LandmarkId> landmarks;  // invalid: a temporary point of the previous frame
    void clear();
  };

  /// Features of the static scene, by everything that the filter knows.
  void observe(const RgbdFrame& frame, const Segmentation* segmentation, TrackingTimes& times);
  /// Sets how many features the next image should give, from how many of this one's may be used.
  void share_features(std::size_t used, std::size_t extracted);
  /// Begins a world with this frame, if enough is seen in it.
  void initialise(const RgbdFrame& frame, Output& output);
  /// The same for a frame that is lost.
  void begin_anew(const RgbdFrame& frame, Output& output);
  void estimate(const RgbdFrame& frame, bool may_request, Output& output);
  void lose(FrameId frame, Output& output);
  /// Moves the previous frame with its reference key frame when mapping has adjusted that, and follows fused landmarks.
  void adopt(std::shared_ptr<const LocalMap> local);
  bool track_motion(const SE3& predicted, double radius_factor);
  bool track_descriptors();
  int track_local_map(const RgbdFrame& frame);
  /// Where the local map says nothing (it is hidden, or this part of the scene is not mapped yet) the previous frame
  /// goes on being the reference: its pose stays, and a key frame will be asked for. @return the inliers.
  int keep_frame_matches();
  /// Whether that may go on: where no key frame will follow, it only drifts away.
  bool may_leave_map() const;
  SurfaceCheck look_at(const RgbdFrame& frame, const LandmarkView& view) const;
  int estimate_pose(Candidates& candidates, SE3& camera_from_world);
  bool wants_key_frame(int inliers, FrameId frame) const;
  /// The key frame that is nearest to the camera now, where that is another one than the snapshot's reference.
  std::optional<LocalMapRequest> wants_local_map(FrameId frame);
  /// Frames since the last key frame, or since mapping was asked last; very many where there was none.
  int frames_since_request(FrameId frame) const;
  KeyFrameRequest make_request(const RgbdFrame& frame);
  void count_uses(const std::vector<LandmarkId>& visible, const std::vector<LandmarkId>& found);

  TrackingOptions options_;
  const MapUse use_;
  std::shared_ptr<const ObservationModel> model_;
  OrbExtractor extractor_;
  int orb_features_;  // wanted on the static scene
  DynamicFilter filter_;
  std::shared_ptr<const LocalMap> local_;
  Tracked current_, last_;
  SE3 velocity_;  // current_from_last
  bool has_velocity_ = false;
  int lost_frames_ = 0;     // in a row, up to now
  int frames_off_map_ = 0;  // in a row, in which the local map said nothing
  std::optional<RelativePose> last_relative_;
  bool waiting_for_map_ = false;  // the first request was made
  FrameId last_request_;          // that a key frame, or a snapshot, was asked for; invalid: none is pending
  KeyFrameId asked_reference_;    // of the snapshot that was asked for last
  std::unordered_map<LandmarkId, LandmarkUse> uses_;

  // Scratch that is kept to save allocations.
  std::vector<ProjectedQuery> queries_;
  std::vector<Match> matches_;
  std::vector<std::uint8_t> inlier_, is_tracked_;
  std::vector<int> query_source_;
  std::vector<cv::Point2f> pixels_;
  Candidates candidates_, frame_matches_;  // the latter: with the previous frame, where that gave the pose
};

}  // namespace semvslam
