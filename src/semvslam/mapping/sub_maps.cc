#include "semvslam/mapping/sub_maps.h"

#include <algorithm>
#include <utility>

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

std::vector<Sighting> JoinFinder::find(const Map& map, const PlaceIndex& places, KeyFrameId id) {
  const KeyFrame& key_frame = *map.key_frame(id);
  if (map.sub_maps().size() < 2) return {};
  std::optional<Relocalisation> place =
      relocalise(map, places, *key_frame.features, search_, {.without = key_frame.sub_map});
  if (!place) return {};
  const SE3& camera_from_own = key_frame.camera_from_world;
  Candidate now{key_frame.sub_map, map.sub_map_of(place->key_frame),
                place->camera_from_world.inverse() * camera_from_own};
  if (candidate_ && candidate_->own == now.own && candidate_->other == now.other &&
      agree(candidate_->other_from_own, now.other_from_own, camera_from_own, agreement_))
    now.agreeing = std::move(candidate_->agreeing);
  now.agreeing.push_back({id, std::move(*place)});
  candidate_ = std::move(now);
  if (candidate_->agreeing.size() < static_cast<std::size_t>(options_.agreeing_key_frames)) return {};
  return std::exchange(candidate_, std::nullopt)->agreeing;
}

SubMapJoin join_sub_maps(Map& map, const std::vector<Sighting>& sightings) {
  const Sighting& best = *std::ranges::max_element(sightings, {}, [](const Sighting& s) { return s.place.inliers; });
  const SubMapId own = map.sub_map_of(best.key_frame), other = map.sub_map_of(best.place.key_frame);
  const SE3 other_from_own = best.place.camera_from_world.inverse() * map.camera_from_world(best.key_frame).value();
  const SubMapId younger = std::max(own, other);
  SubMapJoin join{younger, std::min(own, other), map.key_frames_of(younger)};
  map.join(join.from, join.into, join.from == own ? other_from_own : other_from_own.inverse());
  for (const Sighting& s : sightings)
    if (map.key_frame(s.key_frame) != nullptr) fuse_matches(map, s.key_frame, s.place.matches());
  return join;
}

}  // namespace semvslam
