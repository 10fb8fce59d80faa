#include "semvslam/map/local_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace semvslam {
namespace {

template <typename Element, typename IdType>
const Element* find_by_id(const std::vector<Element>& sorted, IdType id) {
  const auto it =
      std::lower_bound(sorted.begin(), sorted.end(), id, [](const Element& e, IdType i) { return e.id < i; });
  return it != sorted.end() && it->id == id ? &*it : nullptr;
}

Eigen::Vector3d viewing_direction(const SE3& camera_from_world) {
  return camera_from_world.rotation().conjugate() * Eigen::Vector3d::UnitZ();
}

}  // namespace

const LocalMap::Point* LocalMap::find(LandmarkId id) const { return find_by_id(points, id); }
const LocalMap::KeyFramePose* LocalMap::find(KeyFrameId id) const { return find_by_id(key_frames, id); }

KeyFrameId LocalMap::nearest(const SE3& camera_from_world) const {
  constexpr double kMetresPerRad = 1.0 / (40.0 * std::numbers::pi / 180.0);
  const auto distance = [&](const KeyFramePose& key_frame) {
    const SE3 between = camera_from_world * key_frame.camera_from_world.inverse();
    return between.translation().norm() + kMetresPerRad * between.rotation_angle_rad();
  };
  KeyFrameId best;
  double least = std::numeric_limits<double>::infinity();
  for (const KeyFramePose& key_frame : key_frames)
    if (const double d = distance(key_frame); d < least) least = d, best = key_frame.id;
  return best;
}

std::vector<KeyFrameId> nearby_key_frames(const Map& map, KeyFrameId reference, const LocalMapOptions& options,
                                          const std::vector<KeyFrameId>& except) {
  const KeyFrame& from = *map.key_frame(reference);
  const SE3& pose = from.camera_from_world;
  const Eigen::Vector3d centre = pose.inverse().translation();
  const Eigen::Vector3d direction = viewing_direction(pose);
  const double min_cosine = std::cos(options.nearby_angle_deg * std::numbers::pi / 180.0);
  std::vector<std::pair<double, KeyFrameId>> near;
  for (const auto& [id, key_frame] : map.key_frames()) {
    if (key_frame.sub_map != from.sub_map) continue;
    if (id == reference || std::find(except.begin(), except.end(), id) != except.end()) continue;
    const double distance = (key_frame.camera_from_world.inverse().translation() - centre).norm();
    if (distance > options.nearby_distance_m) continue;
    if (viewing_direction(key_frame.camera_from_world).dot(direction) < min_cosine) continue;
    near.emplace_back(distance, id);
  }
  std::sort(near.begin(), near.end());
  if (near.size() > static_cast<std::size_t>(options.nearby_key_frames))
    near.resize(static_cast<std::size_t>(options.nearby_key_frames));
  std::vector<KeyFrameId> ids;
  for (const auto& [distance, id] : near) ids.push_back(id);
  return ids;
}

std::shared_ptr<const LocalMap> make_local_map(const Map& map, KeyFrameId reference, const LocalMapOptions& options) {
  auto local = std::make_shared<LocalMap>();
  local->reference = reference;
  local->sub_map = map.key_frame(reference)->sub_map;
  if (reference >= map.first_of_session()) local->reference_frame = map.key_frame(reference)->frame;
  std::vector<KeyFrameId> window{reference};
  for (const Covisible& c : map.covisible(reference, 1)) {
    if (window.size() > static_cast<std::size_t>(options.covisible_key_frames)) break;
    window.push_back(c.key_frame);
  }
  for (const KeyFrameId id : nearby_key_frames(map, reference, options, window)) window.push_back(id);

  std::vector<LandmarkId> ids;
  for (const KeyFrameId id : window) {
    const KeyFrame& key_frame = *map.key_frame(id);
    int count = 0;
    for (const LandmarkId landmark : key_frame.landmarks) {
      if (!landmark.valid()) continue;
      ++count;
      // The window is sorted by relevance: when the budget is spent, what is left is the least likely to be seen.
      if (ids.size() < 4 * static_cast<std::size_t>(options.max_points)) ids.push_back(landmark);
    }
    local->key_frames.push_back({id, key_frame.camera_from_world, count});
  }
  std::sort(local->key_frames.begin(), local->key_frames.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  if (ids.size() > static_cast<std::size_t>(options.max_points))
    ids.erase(ids.begin(), ids.end() - options.max_points);  // the oldest go
  local->points.reserve(ids.size());
  for (const LandmarkId id : ids) {
    const Landmark& l = *map.landmark(id);
    local->points.push_back({id, l.position, l.normal, l.min_distance_m, l.max_distance_m, l.descriptor,
                             static_cast<int>(l.observations.size())});
  }
  for (const LandmarkId landmark : map.key_frame(reference)->landmarks)
    if (landmark.valid()) ++local->reference_matches;
  local->fused = map.recent_fusions();
  return local;
}

}  // namespace semvslam
