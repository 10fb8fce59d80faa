#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "semvslam/map/map.h"

namespace semvslam {

/// The bounded neighbourhood of the newest key frame that tracking works on: an immutable copy, so that mapping can go
/// on editing the map meanwhile. Its size does not grow with the length of the run.
struct LocalMap {
  struct Point {
    LandmarkId id;
    Eigen::Vector3d position;  // world, metres
    Eigen::Vector3f normal;
    float min_distance_m = 0, max_distance_m = 0;
    Descriptor descriptor{};
    int observations = 0;
  };
  struct KeyFramePose {
    KeyFrameId id;
    SE3 camera_from_world;
    int landmarks = 0;  // that it sees
  };

  KeyFrameId reference;                  // the key frame it was made around
  SubMapId sub_map;                      // of the reference, and of all else
  FrameId reference_frame;               // the frame that the reference was; invalid: one of an earlier session
  int reference_matches = 0;             // landmarks that the reference sees
  std::vector<Point> points;             // ascending by id
  std::vector<KeyFramePose> key_frames;  // ascending by id, the reference included
  std::vector<std::pair<LandmarkId, LandmarkId>> fused;  // recent fusions (from, into), ascending

  const Point* find(LandmarkId id) const;
  const KeyFramePose* find(KeyFrameId id) const;
  /// The key frame whose place and viewing direction are most like the camera's: a metre counts like 40 degrees.
  KeyFrameId nearest(const SE3& camera_from_world) const;
};

struct LocalMapOptions {
  int covisible_key_frames = 20;  // by shared landmarks
  int nearby_key_frames = 10;     // by place and viewing direction: old places come back before any loop is closed
  double nearby_distance_m = 1.0;
  double nearby_angle_deg = 40;
  int max_points = 6000;
};

/// Copies the neighbourhood of `reference` out of the map.
std::shared_ptr<const LocalMap> make_local_map(const Map& map, KeyFrameId reference, const LocalMapOptions& options);

/// Key frames of its sub-map within the distance and angle of `reference` that are not in `except`, nearest first.
std::vector<KeyFrameId> nearby_key_frames(const Map& map, KeyFrameId reference, const LocalMapOptions& options,
                                          const std::vector<KeyFrameId>& except);

}  // namespace semvslam
