#pragma once

#include <optional>
#include <vector>

#include "semvslam/mapping/loop.h"
#include "semvslam/mapping/relocalise.h"

namespace semvslam {

struct SubMapOptions {
  bool enabled = true;
  /// Of a lost camera; the first five frames are searched for, then every fifth: half a second at 30 Hz. A camera that
  /// is found again at all is mostly found by the first search that sees a known place.
  int after_searches = 7;
  /// Two worlds that were joined wrongly stay so. A loop asks two key frames for a fifth of what should be in view;
  /// here, where the two visits may have nothing in common but the place, each is asked for a tenth, and twice as many.
  int agreeing_key_frames = 4;

  void add_to(ConfigSchema& schema);
};

/// A key frame that was found in another sub-map than its own.
struct Sighting {
  KeyFrameId key_frame;
  Relocalisation place;
};

/// Looks for each new key frame in the other sub-maps, as a lost frame is looked for in the map; several must find the
/// same motion between the same two worlds.
class JoinFinder {
 public:
  /// @param agreement says when two motions are the same.
  JoinFinder(const SubMapOptions& options, const RelocaliseOptions& search, const LoopOptions& agreement)
      : options_(options), search_(search), agreement_(agreement) {}

  /// @param id the newest key frame; one call for each. @return those that agree, once they are enough: else none.
  std::vector<Sighting> find(const Map& map, const PlaceIndex& places, KeyFrameId id);

 private:
  struct Candidate {
    SubMapId own, other;
    SE3 other_from_own;                // as the newest has it
    std::vector<Sighting> agreeing{};  // one after the other; key frames that found nothing do not count
  };

  SubMapOptions options_;
  RelocaliseOptions search_;
  LoopOptions agreement_;
  std::optional<Candidate> candidate_;
};

/// What became a part of what.
struct SubMapJoin {
  SubMapId from, into;
  std::vector<KeyFrameId> moved;  // the key frames
};

/// Moves the younger of two sub-maps into the world of the older, of which it becomes a part, as the sighting has it
/// that most landmarks agree with, and fuses what the key frames see in both. @param sightings at least one, all
/// between the same two sub-maps; some may be out of date.
SubMapJoin join_sub_maps(Map& map, const std::vector<Sighting>& sightings);

}  // namespace semvslam
