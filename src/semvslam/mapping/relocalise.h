#pragma once

#include <optional>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/map/map.h"

namespace semvslam {

struct RelocaliseOptions {
  bool enabled = true;
  int candidates = 5;          // key frames that look most like the frame, tried one after the other
  int max_distance_bits = 50;  // descriptors farther apart are no match
  double radius_px = 8;        // search window at level 0 once there is a first pose
  int neighbours = 15;         // of the key frame, whose landmarks are searched then
  int min_inliers = 30;        // landmarks that must agree with the pose
  double min_share = 0.5;      // of those found that must agree

  void add_to(ConfigSchema& schema);
};

/// Where a frame was found in the map.
struct Relocalisation {
  KeyFrameId key_frame;  // that it looks like
  SE3 camera_from_world;
  std::vector<LandmarkId> landmarks;  // per feature; invalid = none
  int inliers = 0;
};

/// Looks for a frame in the whole map by what it looks like, without any idea where the camera is. Every key frame is
/// compared by a sample of the frame's descriptors; for those that agree best PnP gives a pose (estimate_pose()), with
/// which the landmarks around are searched, and a robust pose over all of them decides. Without a vocabulary: the time
/// grows with the number of key frames.
std::optional<Relocalisation> relocalise(const Map& map, const FrameFeatures& features,
                                         const RelocaliseOptions& options);

}  // namespace semvslam
