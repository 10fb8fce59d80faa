#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/base/time_stamp.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/map/frame_features.h"
#include "semvslam/map/local_map.h"

namespace semvslam {

enum class TrackingState { kInitializing, kTracking, kLost };

constexpr std::string_view to_string(TrackingState state) {
  switch (state) {
    case TrackingState::kInitializing:
      return "initializing";
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kLost:
      return "lost";
  }
  return "";
}

/// What tracking is to do with the map.
enum class MapUse {
  kBuild,   // the first frames begin one
  kExtend,  // it is there before the first frame, which is looked for in it; then it grows
  kFollow,  // it is there and stays as it is: only where the camera is in it is of interest
};

/// How a landmark fared since the last key frame: in how many frames it should have been seen, in how many it was, and
/// in how many the depth image saw through its place: what carried it has gone.
struct LandmarkUse {
  LandmarkId landmark;
  int visible = 0, found = 0, seen_through = 0;
};

/// What tracking asks of mapping: keep this frame.
struct KeyFrameRequest {
  FrameId frame;
  TimeStamp stamp;
  std::shared_ptr<const FrameFeatures> features;
  std::vector<LandmarkId> landmarks;  // per feature; invalid = none
  KeyFrameId reference;               // invalid for the first key frame of a map or of a sub-map
  SE3 camera_from_reference;          // stays true when mapping moves the reference meanwhile
  std::vector<LandmarkUse> uses;      // since the previous request
};

/// What tracking asks of a map that stays as it is: the snapshot around another key frame.
struct LocalMapRequest {
  KeyFrameId reference;
};

/// A frame that got lost, to be looked for in the whole map.
struct SearchRequest {
  FrameId frame;
  std::shared_ptr<FrameFeatures> features;
};

/// The pose of a frame relative to the key frame that it was tracked against.
struct RelativePose {
  KeyFrameId reference;
  SE3 camera_from_reference;
};

/// Where the frame of a SearchRequest is.
struct FoundAgain {
  std::shared_ptr<FrameFeatures> features;  // of the request
  std::vector<LandmarkId> landmarks;        // per feature; invalid = none
  RelativePose relative;
  std::shared_ptr<const LocalMap> local;  // around the key frame it was found at
};

}  // namespace semvslam
