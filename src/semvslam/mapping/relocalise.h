#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/map/map.h"
#include "semvslam/place/place_index.h"

namespace semvslam {

struct RelocaliseOptions {
  bool enabled = true;
  int candidates = 5;           // key frames that look most like the frame, tried one after the other
  int max_distance_bits = 50;   // descriptors farther apart are no match
  double radius_px = 8;         // search window at level 0 once there is a first pose
  int neighbours = 15;          // of the key frame, whose landmarks are searched then
  int min_inliers = 30;         // landmarks that must agree with the pose
  double min_share = 0.5;       // of those found that must agree
  double min_seen_share = 0.1;  // of those that should be in view, which must agree

  void add_to(ConfigSchema& schema);
};

/// Where a frame was found in the map.
struct Relocalisation {
  KeyFrameId key_frame;  // that it looks like
  SE3 camera_from_world;
  std::vector<LandmarkId> landmarks;  // per feature; invalid = none
  int inliers = 0;

  /// Landmarks and the features they are.
  std::vector<std::pair<LandmarkId, std::uint32_t>> matches() const;
};

/// The part of the map that is searched.
struct SearchScope {
  /// Key frames from this one on are left out, and so is every landmark that one of them sees.
  KeyFrameId before{KeyFrameId::kNone};
  /// So are these key frames, and those that share landmarks with them.
  std::vector<KeyFrameId> apart_from = {};
  /// The one sub-map that is searched, and the one that is not; invalid = all, none.
  SubMapId within = {}, without = {};
};

/// Looks for a frame in the map by what it looks like, without any idea where the camera is. The index names key
/// frames, which are compared by a sample of the frame's descriptors; for those that agree best PnP gives a pose
/// (estimate_pose()), with which the landmarks around are searched, and a robust pose over all of them decides. A wrong
/// pose also finds some dozens of landmarks that agree, on a thing that was moved or looks like another, but few of all
/// that should be seen.
std::optional<Relocalisation> relocalise(const Map& map, const PlaceIndex& places, const FrameFeatures& features,
                                         const RelocaliseOptions& options, const SearchScope& scope = {});

}  // namespace semvslam
