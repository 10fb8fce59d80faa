#pragma once

#include <optional>

#include "semvslam/mapping/relocalise.h"
#include "semvslam/mapping/revisit.h"

namespace semvslam {

struct LoopOptions {
  bool enabled = true;
  /// What no key frame since these newest ones has seen belongs to an earlier visit.
  int recent_key_frames = 10;
  int candidates = 3;            // key frames that look most like the new one, tried one after the other
  int min_inliers = 40;          // landmarks of the earlier visit that must agree with one pose
  double min_seen_share = 0.2;   // of its landmarks that should be in view, which must be found
  double agreement_m = 0.3;      // two key frames in a row must find the same correction, at the camera's place,
  double agreement_deg = 4;      // and of its direction
  double least_shift_px = 2;     // by which the correction must move the landmarks
  double max_drift_share = 0.2;  // of the way since then; a correction beyond that is a look-alike
  double drift_allowance_m = 0.3;
  double drift_allowance_deg = 15;

  void add_to(ConfigSchema& schema);
};

/// Whether two motions of a world agree, as they are seen from the camera.
bool agree(const SE3& a, const SE3& b, const SE3& camera_from_world, const LoopOptions& options);

/// Closes loops by appearance, however far the map has drifted: a key frame is looked for in the earlier part of its
/// sub-map as a lost frame is (relocalise()), and the next one must find the same. Close with close_revisit(). Of the
/// checks two are for scenes where things are moved and look alike: of what the earlier key frame saw a share must be
/// seen, for a moved poster brings none of its wall; and a correction must be small beside the way that it is to be the
/// drift of.
class LoopFinder {
 public:
  explicit LoopFinder(const LoopOptions& options) : options_(options) {}

  /// @param id the newest key frame; one call for each. @return the loop, once two in a row agree.
  std::optional<Revisit> find(const Map& map, const PlaceIndex& places, KeyFrameId id);

 private:
  std::optional<Revisit> candidate(const Map& map, const PlaceIndex& places, KeyFrameId id) const;
  bool is_plausible(const Map& map, KeyFrameId id, const Revisit& loop) const;

  LoopOptions options_;
  std::optional<SE3> last_correction_;  // corrected world from world, as the key frame before found it
};

}  // namespace semvslam
