#pragma once

#include <memory>
#include <stop_token>
#include <utility>
#include <vector>

#include "semvslam/feature/matching.h"
#include "semvslam/map/local_map.h"
#include "semvslam/map/map.h"
#include "semvslam/mapping/loop.h"
#include "semvslam/mapping/relocalise.h"
#include "semvslam/mapping/revisit.h"
#include "semvslam/mapping/sub_maps.h"
#include "semvslam/solve/bundle_adjustment.h"

namespace semvslam {

struct MappingOptions {
  bool frozen = false;                // a saved map is only looked at: nothing in it changes
  double max_landmark_depth_m = 6.0;  // landmarks are made from depth up to here
  double min_found_ratio = 0.1;       // found / visible below which a young landmark goes; blur hides good ones too
  int young_key_frames = 3;           // a landmark must have three observations after so many key frames
  int fuse_key_frames = 12;           // neighbours in which the new key frame's landmarks are searched, and vice versa
  double fuse_radius_px = 3;          // at level 0
  int bundle_key_frames = 15;         // optimised in a local bundle adjustment
  int bundle_fixed_key_frames = 30;   // that hold it in place
  int final_bundles = 2;         // full bundle adjustments when the run ends; the second without the first's outliers
  int min_shared = 15;           // landmarks that make two key frames neighbours
  int seen_through = 3;          // frames of that, and more than it was found in: the landmark's place is empty now
  double redundant_ratio = 0.9;  // a key frame goes when this share of its landmarks is seen in three others
  LocalMapOptions local_map;
  RevisitOptions revisit;
  LoopOptions loop;
  RelocaliseOptions relocalise;
  SubMapOptions sub_maps;
};

/// A key frame as tracking saw it, ready to be put into the map.
struct NewKeyFrame {
  FrameId frame;
  TimeStamp stamp;
  SE3 camera_from_world;
  std::shared_ptr<const FrameFeatures> features;
  std::vector<LandmarkId> landmarks;  // per feature; invalid = none; ids may be out of date
  SubMapId sub_map{0};                // one that is not there begins with it
};

/// Milliseconds of one mapping step, by part.
struct MappingTimes {
  double create_ms = 0, join_ms = 0, revisit_ms = 0, loop_ms = 0, fuse_ms = 0, bundle_ms = 0, cull_ms = 0, total_ms = 0;
};

/// The one writer of the map: takes key frames in, makes, fuses, adjusts and culls. Every step works on a bounded
/// neighbourhood of the new key frame; only when drift is removed, or a sub-map joined, all its key frames move. No
/// threads inside; the same calls give the same map.
class Mapper {
 public:
  Mapper(const MappingOptions& options, std::shared_ptr<const ObservationModel> model)
      : Mapper(options, Map(std::move(model))) {}
  /// Goes on with a map; what an earlier session left in it stands: none of its landmarks is young any more.
  Mapper(const MappingOptions& options, Map map);

  /// @return the snapshot that tracking goes on with.
  std::shared_ptr<const LocalMap> step(const NewKeyFrame& key_frame, std::stop_token stop = {});
  /// Full bundle adjustment over every key frame and landmark of each sub-map that this session has added to.
  void adjust_all(std::stop_token stop = {});
  /// Looks for a lost frame in the whole map; nothing when it is nowhere, or not to be looked for.
  std::optional<Relocalisation> relocalise(const FrameFeatures& features) const {
    return options_.relocalise.enabled ? semvslam::relocalise(map_, places_, features, options_.relocalise)
                                       : std::nullopt;
  }
  /// The snapshot around a key frame of the map, for tracking to go on there.
  std::shared_ptr<const LocalMap> local_map(KeyFrameId reference) const {
    return make_local_map(map_, reference, options_.local_map);
  }
  /// How a landmark fared in the frames since the last key frame: in how many it should have been seen, was found, and
  /// was looked through by the depth image. One that was mostly looked through is gone and removed.
  void count_use(LandmarkId id, int visible, int found, int seen_through);

  const Map& map() const { return map_; }
  const MappingTimes& times() const { return times_; }
  /// How often drift since an earlier visit was removed: found where the camera should be, found by appearance.
  int revisits() const { return revisits_; }
  int loops() const { return loops_; }
  /// How often two sub-maps were joined, and which ones by the last step.
  int joins() const { return joins_; }
  const std::optional<SubMapJoin>& joined() const { return joined_; }

 private:
  KeyFrameId insert(const NewKeyFrame& key_frame);
  void create_landmarks(KeyFrameId id);
  /// Joins its sub-map with another that it is recognised in.
  void join(KeyFrameId id);
  void cull_landmarks(KeyFrameId newest);
  std::vector<KeyFrameId> fusion_partners(KeyFrameId id) const;
  void fuse_with_neighbours(KeyFrameId id);
  /// After a join. Its sightings are often of things that one side knows from far away only, and has some centimetres
  /// off: before what both have seen can be fused, everything moves, as at the end of a run, and once more after it.
  void adjust_joined(std::stop_token stop);
  void adjust_all_of(SubMapId sub_map, std::stop_token stop);
  /// Searches landmarks in a key frame's image; adds observations and fuses duplicates.
  void fuse_into(const std::vector<LandmarkId>& landmarks, KeyFrameId target);
  void adjust_neighbourhood(KeyFrameId id, std::stop_token stop);
  /// Bundle adjustment of the key frames in `window` and all landmarks they see; others that see them hold them in
  /// place.
  void adjust(const std::vector<KeyFrameId>& window, BaOptions options, std::stop_token stop);
  void cull_key_frames(KeyFrameId newest);
  /// Holds its sub-map's world: is neither moved nor removed.
  bool is_first(KeyFrameId id) const { return id == map_.sub_maps().at(map_.key_frame(id)->sub_map); }
  bool is_redundant(const KeyFrame& key_frame) const;

  MappingOptions options_;
  Map map_;
  MappingTimes times_;
  PlaceIndex places_;  // of every key frame
  LoopFinder loop_finder_;
  JoinFinder join_finder_;
  std::optional<SubMapJoin> joined_;
  int revisits_ = 0, loops_ = 0, joins_ = 0;
  std::vector<LandmarkId> young_;  // ascending
  std::vector<ProjectedQuery> queries_;
  std::vector<Match> matches_;
};

}  // namespace semvslam
