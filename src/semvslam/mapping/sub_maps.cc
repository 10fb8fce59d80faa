#include "semvslam/mapping/sub_maps.h"

#include <algorithm>

namespace semvslam {

void SubMapOptions::add_to(ConfigSchema& s) {
  s.add(
      "mapping.submaps.enabled", &enabled,
      "a lost camera that is nowhere in the map begins a map of its own, which is joined when its place is recognised");
  s.add("mapping.submaps.after_searches", &after_searches, {1, 100000},
        "frames that were looked for in vain before that");
  s.add("mapping.submaps.agreeing_key_frames", &agreeing_key_frames, {2, 1000},
        "key frames that must find the same motion between two sub-maps (mapping.loop.agreement_*) for these to be "
        "joined; each is looked for as a lost frame is (mapping.relocalise.*)");
}

std::optional<Relocalisation> JoinFinder::find(const Map& map, const PlaceIndex& places, KeyFrameId id) {
  const KeyFrame& key_frame = *map.key_frame(id);
  if (map.sub_maps().size() < 2) return std::nullopt;
  std::optional<Relocalisation> place =
      relocalise(map, places, *key_frame.features, search_, {.without = key_frame.sub_map});
  if (!place) return std::nullopt;
  const SE3& camera_from_own = key_frame.camera_from_world;
  Candidate now{key_frame.sub_map, map.sub_map_of(place->key_frame),
                place->camera_from_world.inverse() * camera_from_own, 1};
  if (candidate_ && candidate_->own == now.own && candidate_->other == now.other &&
      agree(candidate_->other_from_own, now.other_from_own, camera_from_own, agreement_))
    now.agreeing += candidate_->agreeing;
  candidate_ = now;
  if (now.agreeing < options_.agreeing_key_frames) return std::nullopt;
  candidate_.reset();
  return place;
}

SubMapJoin join_sub_maps(Map& map, KeyFrameId id, const Relocalisation& place) {
  const KeyFrame& key_frame = *map.key_frame(id);
  const SubMapId own = key_frame.sub_map, other = map.sub_map_of(place.key_frame);
  const SE3 other_from_own = place.camera_from_world.inverse() * key_frame.camera_from_world;
  const SubMapJoin join{std::max(own, other), std::min(own, other)};
  map.join(join.from, join.into, join.from == own ? other_from_own : other_from_own.inverse());
  fuse_matches(map, id, place.matches());
  return join;
}

}  // namespace semvslam
