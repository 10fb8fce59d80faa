#include "semvslam/mapping/loop.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "semvslam/mapping/landmark_search.h"

namespace semvslam {
namespace {

constexpr int kConnected = 15;  // landmarks by which key frames hold each other already
constexpr double kDegPerRad = 180 / std::numbers::pi;

}  // namespace

void LoopOptions::add_to(ConfigSchema& s) {
  s.add("mapping.loop.enabled", &enabled, "places seen before are recognised by what they look like, and loops closed");
  s.add("mapping.loop.recent_key_frames", &recent_key_frames, {1, 1000},
        "what none of so many newest key frames sees belongs to an earlier visit");
  s.add("mapping.loop.candidates", &candidates, {1, 1000},
        "key frames that look most like the new one, tried one after the other");
  s.add("mapping.loop.min_inliers", &min_inliers, {6, 10000}, "landmarks that must agree with one pose");
  s.add("mapping.loop.min_seen_share", &min_seen_share, {0, 1},
        "of the earlier visit's landmarks that should be in view, the share that must be found");
  s.add("mapping.loop.agreement_m", &agreement_m, {0, 100},
        "the corrections that two key frames in a row find differ by no more, m");
  s.add("mapping.loop.agreement_deg", &agreement_deg, {0, 180}, "and by no more, degrees");
  s.add("mapping.loop.least_shift_px", &least_shift_px, {0, 100},
        "less of a correction is left to fusion and bundle adjustment, px");
  s.add("mapping.loop.max_drift_share", &max_drift_share, {0, 10},
        "of the way (and of the turning) since the earlier visit; a larger correction is none");
  s.add("mapping.loop.drift_allowance_m", &drift_allowance_m, {0, 100}, "that much is always believed, m");
  s.add("mapping.loop.drift_allowance_deg", &drift_allowance_deg, {0, 180}, "that much is always believed, degrees");
}

bool agree(const SE3& a, const SE3& b, const SE3& camera_from_world, const LoopOptions& options) {
  const SE3 difference = camera_from_world * a.inverse() * b * camera_from_world.inverse();
  return difference.translation().norm() <= options.agreement_m &&
         difference.rotation_angle_rad() * kDegPerRad <= options.agreement_deg;
}

std::optional<Revisit> LoopFinder::find(const Map& map, const PlaceIndex& places, KeyFrameId id) {
  std::optional<Revisit> found = candidate(map, places, id);
  const std::optional<SE3> before = std::exchange(last_correction_, std::nullopt);
  if (!found) return std::nullopt;
  const SE3& now = map.key_frame(id)->camera_from_world;
  const SE3 correction = found->camera_from_world.inverse() * now;
  if (before && agree(*before, correction, now, options_)) return found;
  last_correction_ = correction;
  return std::nullopt;
}

std::optional<Revisit> LoopFinder::candidate(const Map& map, const PlaceIndex& places, KeyFrameId id) const {
  const KeyFrame& key_frame = *map.key_frame(id);
  SearchScope scope{.before = first_recent(map, id, options_.recent_key_frames), .within = key_frame.sub_map};
  if (scope.before == map.sub_maps().at(key_frame.sub_map)) return std::nullopt;  // nothing is earlier
  for (const Covisible& c : map.covisible(id, kConnected)) scope.apart_from.push_back(c.key_frame);
  const std::optional<Relocalisation> place = relocalise(map, places, *key_frame.features,
                                                         {.candidates = options_.candidates,
                                                          .min_inliers = options_.min_inliers,
                                                          .min_seen_share = options_.min_seen_share},
                                                         scope);
  if (!place) return std::nullopt;
  Revisit loop{place->key_frame, place->camera_from_world, place->matches(), 0};
  loop.shift_px = median_shift_px(map, id, loop);
  if (loop.shift_px < options_.least_shift_px || !is_plausible(map, id, loop)) return std::nullopt;
  return loop;
}

bool LoopFinder::is_plausible(const Map& map, KeyFrameId id, const Revisit& loop) const {
  double way_m = 0, turned_rad = 0;
  const SE3* previous = nullptr;
  for (auto it = map.key_frames().find(loop.earlier); it != map.key_frames().end() && it->first <= id; ++it) {
    if (it->second.sub_map != map.key_frame(id)->sub_map) continue;
    const SE3& pose = it->second.camera_from_world;
    if (previous != nullptr) {
      const SE3 step = pose * previous->inverse();
      way_m += step.translation().norm();
      turned_rad += step.rotation_angle_rad();
    }
    previous = &pose;
  }
  const SE3 correction = loop.camera_from_world * map.key_frame(id)->camera_from_world.inverse();
  return correction.translation().norm() <= options_.drift_allowance_m + options_.max_drift_share * way_m &&
         correction.rotation_angle_rad() * kDegPerRad <=
             options_.drift_allowance_deg + options_.max_drift_share * turned_rad * kDegPerRad;
}

}  // namespace semvslam
