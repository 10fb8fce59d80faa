#pragma once

#include <Eigen/Core>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/base/result.h"
#include "semvslam/base/sub_map_id.h"
#include "semvslam/base/time_stamp.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/map/frame_features.h"

namespace semvslam {

/// Where a landmark was seen.
struct Observation {
  KeyFrameId key_frame;
  std::uint32_t feature = 0;
  friend bool operator==(const Observation&, const Observation&) = default;
};

/// A point of the static world.
struct Landmark {
  LandmarkId id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world, metres
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();    // mean direction from the cameras that saw it to it, unit length
  float min_distance_m = 0, max_distance_m = 0;        // distances at which its pyramid level lies inside the pyramid
  Descriptor descriptor{};                             // the observation that is nearest to all others
  std::vector<Observation> observations;               // ascending by key frame
  KeyFrameId first_key_frame;
  int visible = 1, found = 1;  // frames in which it should have been / was seen
};

/// An image that the map keeps.
struct KeyFrame {
  KeyFrameId id;
  FrameId frame;  // of the session that it was made in
  TimeStamp stamp;
  SE3 camera_from_world;
  std::shared_ptr<const FrameFeatures> features;
  std::vector<LandmarkId> landmarks;  // per feature; invalid = none
  SubMapId sub_map{0};
};

/// Another key frame that sees the same landmarks.
struct Covisible {
  KeyFrameId key_frame;
  int shared = 0;  // landmarks in common
};

/// All that a map consists of, as plain values; what follows from them is made anew.
struct MapContent {
  std::vector<KeyFrame> key_frames;  // each with its grid; `landmarks` is not looked at, it follows from these:
  std::vector<Landmark> landmarks;
  KeyFrameId next_key_frame{0};  // ids from here on were never given out
  LandmarkId next_landmark{0};
};

/// Key frames and landmarks as values keyed by id; observations indexed from both sides, kept consistent by going
/// through this class for every change. One writer (the mapping stage); no locks inside. Iteration order never depends
/// on addresses.
///
/// Its parts are sub-maps: each has a world of its own, whose place in the others' is not known until they are joined.
/// All key frames that see a landmark are of one sub-map. Mostly there is just one.
class Map {
 public:
  explicit Map(std::shared_ptr<const ObservationModel> model) : model_(std::move(model)) {}
  /// The map of an earlier session. Errors (kInvalidInput): content that contradicts itself, as an id that is there
  /// twice, or an observation of a key frame or a feature that is not there; what check_invariants() finds.
  static Result<Map> restore(std::shared_ptr<const ObservationModel> model, MapContent content);

  const ObservationModel& model() const { return *model_; }
  /// @param model with the same pyramid levels: key frames and landmarks refer to them.
  void set_model(std::shared_ptr<const ObservationModel> model) { model_ = std::move(model); }

  /// @param sub_map that it belongs to, and whose world the pose is in; one that is not there begins.
  KeyFrameId add_key_frame(FrameId frame, TimeStamp stamp, const SE3& camera_from_world,
                           std::shared_ptr<const FrameFeatures> features, SubMapId sub_map = SubMapId(0));
  /// Removes a key frame with its observations; landmarks that nobody sees any more go too. Its pose stays known
  /// relative to `anchor` (see camera_from_world), so that the frames tracked against it keep theirs.
  void remove_key_frame(KeyFrameId id, KeyFrameId anchor);

  /// Moves a sub-map into the world of another, of which it is a part from then on; with it go the poses of the key
  /// frames that were removed from it.
  void join(SubMapId from, SubMapId into, const SE3& into_from_from);

  LandmarkId add_landmark(const Eigen::Vector3d& position, KeyFrameId key_frame, std::uint32_t feature);
  void remove_landmark(LandmarkId id);
  /// `from` was found to be the same point as `into`: moves the observations over; resolve(from) == into afterwards.
  void fuse_landmarks(LandmarkId from, LandmarkId into);
  /// @return false when the key frame sees the landmark already or the feature is taken.
  bool add_observation(LandmarkId landmark, KeyFrameId key_frame, std::uint32_t feature);
  /// Removes one observation; a landmark left without any is removed.
  void remove_observation(LandmarkId landmark, KeyFrameId key_frame);

  void set_pose(KeyFrameId id, const SE3& camera_from_world) {
    key_frames_.at(id).camera_from_world = camera_from_world;
  }
  void set_position(LandmarkId id, const Eigen::Vector3d& p) { landmarks_.at(id).position = p; }
  void count_visible(LandmarkId id, int visible, int found);
  /// Recomputes descriptor, normal and distance limits from the observations.
  void refresh_landmark(LandmarkId id);
  /// Normal and distance limits only (after poses or positions moved).
  void refresh_geometry(LandmarkId id);

  const KeyFrame* key_frame(KeyFrameId id) const;
  const Landmark* landmark(LandmarkId id) const;
  /// Follows fusions: the id under which a landmark lives now; invalid when it is gone.
  LandmarkId resolve(LandmarkId id) const;
  /// The newest fusions (from, into), ascending by `from`; older ones are forgotten.
  std::vector<std::pair<LandmarkId, LandmarkId>> recent_fusions() const;
  /// Pose of a key frame, also of one that was removed (through its anchor). Empty for ids never given out.
  std::optional<SE3> camera_from_world(KeyFrameId id) const;
  /// The sub-map whose world that pose is in. Invalid for ids never given out.
  SubMapId sub_map_of(KeyFrameId id) const;
  SubMapId sub_map_of(const Landmark& landmark) const {
    return key_frames_.at(landmark.observations.front().key_frame).sub_map;
  }

  /// Key frames that share at least `min_shared` landmarks with `id`, most first (ties: newer first). Computed on
  /// demand.
  std::vector<Covisible> covisible(KeyFrameId id, int min_shared) const;

  const std::map<KeyFrameId, KeyFrame>& key_frames() const { return key_frames_; }
  std::size_t landmark_count() const { return landmarks_.size(); }
  /// The first key frame of each sub-map: what holds its world.
  const std::map<SubMapId, KeyFrameId>& sub_maps() const { return sub_maps_; }
  /// Ids from here on were never given out.
  SubMapId next_sub_map() const { return SubMapId(next_sub_map_); }
  /// Ascending.
  std::vector<KeyFrameId> key_frames_of(SubMapId sub_map) const;
  /// A copy with this sub-map alone.
  Map part(SubMapId sub_map) const;
  /// Key frames from this id on are of this session: the first one's after restore().
  KeyFrameId first_of_session() const { return first_of_session_; }
  KeyFrameId next_key_frame() const { return KeyFrameId(next_key_frame_); }
  LandmarkId next_landmark() const { return LandmarkId(next_landmark_); }
  /// Ids of the landmarks of a sub-map, or of all, ascending.
  std::vector<LandmarkId> landmark_ids(std::optional<SubMapId> sub_map = {}) const;
  /// Their positions, by id, in the sub-map's world, metres.
  std::vector<Eigen::Vector3d> landmark_positions(std::optional<SubMapId> sub_map = {}) const;
  /// Ids of the landmarks that any of these key frames sees, ascending.
  std::vector<LandmarkId> landmarks_of(const std::vector<KeyFrameId>& key_frames) const;

  /// Everything that must hold between key frames, landmarks and observations; the message names the first broken rule.
  Status check_invariants() const;

 private:
  struct Removed {
    KeyFrameId anchor;
    SE3 camera_from_anchor;
  };

  /// A key frame that is there, and another seen from it, which may have been removed.
  struct Anchored {
    const KeyFrame& key_frame;
    SE3 camera_from_key_frame;
  };
  std::optional<Anchored> anchor_of(KeyFrameId id) const;
  /// A key frame of a sub-map that may be new.
  void enlist(KeyFrameId id, SubMapId sub_map);

  std::shared_ptr<const ObservationModel> model_;
  std::map<KeyFrameId, KeyFrame> key_frames_;
  std::map<SubMapId, KeyFrameId> sub_maps_;
  std::unordered_map<LandmarkId, Landmark> landmarks_;
  std::unordered_map<KeyFrameId, Removed> removed_key_frames_;
  std::map<LandmarkId, LandmarkId> fused_;
  std::deque<LandmarkId> fused_order_;  // oldest first
  std::uint32_t next_key_frame_ = 0, next_landmark_ = 0, next_sub_map_ = 0;
  KeyFrameId first_of_session_{0};
};

}  // namespace semvslam
