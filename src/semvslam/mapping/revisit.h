#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/map/local_map.h"
#include "semvslam/map/map.h"

namespace semvslam {

struct RevisitOptions {
  bool enabled = true;
  /// Landmarks that none of so many newest key frames sees belong to an earlier visit.
  int recent_key_frames = 10;
  int key_frames = 8;         // of the earlier visit, the nearest ones, whose landmarks are searched
  double distance_m = 0.7;    // between the camera then and now; the drift since then included
  double angle_deg = 35;      // between the viewing directions
  double radius_px = 20;      // search window at level 0
  int min_inliers = 20;       // landmarks that must agree with one corrected pose
  double min_share = 0.6;     // of those that were found must agree
  double least_shift_px = 2;  // by which the correction must move them; less is left to fusion and bundle adjustment

  void add_to(ConfigSchema& schema);
};

/// An earlier part of the map that a key frame sees again, some drift away from where its own part of the map has it.
struct Revisit {
  KeyFrameId earlier;                                         // the nearest key frame of that visit
  SE3 camera_from_world;                                      // of the key frame, as that visit's landmarks have it
  std::vector<std::pair<LandmarkId, std::uint32_t>> matches;  // that visit's landmarks and the features they are
  double shift_px = 0;                                        // median
};

/// How far the correction moves the matched landmarks in the key frame's image: median, pixels.
double median_shift_px(const Map& map, KeyFrameId id, const Revisit& revisit);

/// Searches the landmarks of earlier visits, which the last key frames did not see, around where the newest key frame
/// should see them. The window is wide enough for centimetres of drift; a robust pose over all that is found decides.
/// Finds places whose drift is still small, at any speed; for the others see loop.h.
std::optional<Revisit> find_revisit(const Map& map, KeyFrameId id, const RevisitOptions& options);

/// Fuses the landmarks of a key frame's features with those that they were found to be.
void fuse_matches(Map& map, KeyFrameId id, const std::vector<std::pair<LandmarkId, std::uint32_t>>& matches);

/// Spreads the correction over the key frames since then and moves their landmarks along (essential graph: Strasdat et
/// al., Double window optimisation for constant time visual SLAM, ICCV 2011; ORB-SLAM, section VII-C), then fuses the
/// matches. Links between key frames weigh by the landmarks they share, so that weak ones, as in blurred images, give
/// way. @return false when nothing was changed.
bool close_revisit(Map& map, KeyFrameId id, const Revisit& revisit);

}  // namespace semvslam
