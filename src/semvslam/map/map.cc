#include "semvslam/map/map.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace semvslam {

Result<Map> Map::restore(std::shared_ptr<const ObservationModel> model, MapContent content) {
  const auto invalid = [](std::string what) { return Error{ErrorCode::kInvalidInput, std::move(what)}; };
  Map map(std::move(model));
  for (KeyFrame& key_frame : content.key_frames) {
    const KeyFrameId id = key_frame.id;
    if (id >= content.next_key_frame)
      return invalid(fmt::format("key frame {} has an id that was never given out", id.value));
    key_frame.landmarks.assign(key_frame.features->size(), LandmarkId());
    map.enlist(id, key_frame.sub_map);
    if (!map.key_frames_.emplace(id, std::move(key_frame)).second)
      return invalid(fmt::format("key frame {} is there twice", id.value));
  }
  for (Landmark& landmark : content.landmarks) {
    const LandmarkId id = landmark.id;
    if (id >= content.next_landmark || landmark.first_key_frame >= content.next_key_frame)
      return invalid(fmt::format("landmark {} has an id that was never given out", id.value));
    const std::vector<Observation> observations = std::exchange(landmark.observations, {});
    if (!map.landmarks_.emplace(id, std::move(landmark)).second)
      return invalid(fmt::format("landmark {} is there twice", id.value));
    for (const Observation& o : observations) {
      const KeyFrame* seen_in = map.key_frame(o.key_frame);
      if (seen_in == nullptr || o.feature >= seen_in->features->size())
        return invalid(fmt::format("landmark {} is seen as feature {} of key frame {}, which is not there", id.value,
                                   o.feature, o.key_frame.value));
      if (!map.add_observation(id, o.key_frame, o.feature))
        return invalid(fmt::format("landmark {} sees feature {} of key frame {}, which is another's, or sees it twice",
                                   id.value, o.feature, o.key_frame.value));
    }
  }
  map.next_key_frame_ = content.next_key_frame.value;
  map.next_landmark_ = content.next_landmark.value;
  map.first_of_session_ = content.next_key_frame;
  if (Status status = map.check_invariants(); !status) return invalid(status.error().message);
  return map;
}

KeyFrameId Map::add_key_frame(FrameId frame, TimeStamp stamp, const SE3& camera_from_world,
                              std::shared_ptr<const FrameFeatures> features, SubMapId sub_map) {
  const KeyFrameId id(next_key_frame_++);
  KeyFrame key_frame{id, frame, stamp, camera_from_world, std::move(features), {}, sub_map};
  key_frame.landmarks.resize(key_frame.features->size());
  key_frames_.emplace(id, std::move(key_frame));
  enlist(id, sub_map);
  return id;
}

void Map::enlist(KeyFrameId id, SubMapId sub_map) {
  const auto first = sub_maps_.try_emplace(sub_map, id).first;
  first->second = std::min(first->second, id);
  next_sub_map_ = std::max(next_sub_map_, sub_map.value + 1);
}

void Map::remove_key_frame(KeyFrameId id, KeyFrameId anchor) {
  const auto it = key_frames_.find(id);
  if (it == key_frames_.end() || id == anchor || !key_frames_.contains(anchor))
    throw std::logic_error(fmt::format("Map::remove_key_frame: {} with anchor {}", id.value, anchor.value));
  const std::vector<LandmarkId> seen = it->second.landmarks;
  for (const LandmarkId landmark : seen)
    if (landmark.valid()) remove_observation(landmark, id);
  removed_key_frames_[id] = {anchor, it->second.camera_from_world * key_frames_.at(anchor).camera_from_world.inverse()};
  const SubMapId sub_map = it->second.sub_map;
  key_frames_.erase(it);
  if (sub_maps_.at(sub_map) != id) return;
  sub_maps_.erase(sub_map);
  if (const std::vector<KeyFrameId> left = key_frames_of(sub_map); !left.empty()) enlist(left.front(), sub_map);
}

void Map::join(SubMapId from, SubMapId into, const SE3& into_from_from) {
  if (from == into || !sub_maps_.contains(from) || !sub_maps_.contains(into))
    throw std::logic_error(fmt::format("Map::join: {} into {}", from.value, into.value));
  const std::vector<LandmarkId> landmarks = landmark_ids(from);
  const SE3 from_from_into = into_from_from.inverse();
  for (const KeyFrameId id : key_frames_of(from)) {
    KeyFrame& key_frame = key_frames_.at(id);
    key_frame.camera_from_world = key_frame.camera_from_world * from_from_into;
    key_frame.sub_map = into;
    enlist(id, into);
  }
  sub_maps_.erase(from);
  for (const LandmarkId id : landmarks) set_position(id, into_from_from * landmarks_.at(id).position);
  for (const LandmarkId id : landmarks) refresh_geometry(id);
}

LandmarkId Map::add_landmark(const Eigen::Vector3d& position, KeyFrameId key_frame, std::uint32_t feature) {
  const LandmarkId id(next_landmark_++);
  Landmark landmark;
  landmark.id = id;
  landmark.position = position;
  landmark.first_key_frame = key_frame;
  landmarks_.emplace(id, std::move(landmark));
  if (!add_observation(id, key_frame, feature)) throw std::logic_error("Map::add_landmark: the feature is taken");
  refresh_landmark(id);
  return id;
}

void Map::remove_landmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  if (it == landmarks_.end()) return;
  for (const Observation& o : it->second.observations) key_frames_.at(o.key_frame).landmarks[o.feature] = LandmarkId();
  landmarks_.erase(it);
}

void Map::fuse_landmarks(LandmarkId from, LandmarkId into) {
  if (from == into || !landmarks_.contains(from) || !landmarks_.contains(into)) return;
  const Landmark source = landmarks_.at(from);
  remove_landmark(from);
  for (const Observation& o : source.observations) add_observation(into, o.key_frame, o.feature);
  Landmark& target = landmarks_.at(into);
  target.visible += source.visible;
  target.found += source.found;
  // Whoever still holds an old id lags by a few key frames at most, so the memory of fusions may be short.
  constexpr std::size_t kRemembered = 4000;
  if (fused_.emplace(from, into).second) fused_order_.push_back(from);
  if (fused_order_.size() > kRemembered) {
    fused_.erase(fused_order_.front());
    fused_order_.pop_front();
  }
  refresh_landmark(into);
}

bool Map::add_observation(LandmarkId landmark, KeyFrameId key_frame, std::uint32_t feature) {
  Landmark& point = landmarks_.at(landmark);
  LandmarkId& slot = key_frames_.at(key_frame).landmarks.at(feature);
  if (slot.valid()) return false;
  const auto at = std::lower_bound(point.observations.begin(), point.observations.end(), key_frame,
                                   [](const Observation& o, KeyFrameId k) { return o.key_frame < k; });
  if (at != point.observations.end() && at->key_frame == key_frame) return false;
  point.observations.insert(at, {key_frame, feature});
  slot = landmark;
  return true;
}

void Map::remove_observation(LandmarkId landmark, KeyFrameId key_frame) {
  const auto it = landmarks_.find(landmark);
  if (it == landmarks_.end()) return;
  std::vector<Observation>& all = it->second.observations;
  const auto at = std::find_if(all.begin(), all.end(), [&](const Observation& o) { return o.key_frame == key_frame; });
  if (at == all.end()) return;
  key_frames_.at(key_frame).landmarks[at->feature] = LandmarkId();
  all.erase(at);
  if (all.empty()) landmarks_.erase(it);
}

void Map::count_visible(LandmarkId id, int visible, int found) {
  const auto it = landmarks_.find(resolve(id));
  if (it == landmarks_.end()) return;
  it->second.visible += visible;
  it->second.found += found;
}

void Map::refresh_landmark(LandmarkId id) {
  Landmark& point = landmarks_.at(id);
  const auto descriptor_of = [&](const Observation& o) -> const Descriptor& {
    return key_frames_.at(o.key_frame).features->orb.descriptors[o.feature];
  };
  // The newest observations stand for all: the choice stays O(1) however often the landmark was seen.
  constexpr std::size_t kMost = 12;
  const std::size_t n = std::min(kMost, point.observations.size());
  const std::size_t first = point.observations.size() - n;
  int best_sum = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < n; ++i) {
    const Descriptor& candidate = descriptor_of(point.observations[first + i]);
    int sum = 0;
    for (std::size_t j = 0; j < n; ++j)
      sum += hamming_distance(candidate, descriptor_of(point.observations[first + j]));
    if (sum < best_sum) {
      best_sum = sum;
      point.descriptor = candidate;
    }
  }
  refresh_geometry(id);
}

void Map::refresh_geometry(LandmarkId id) {
  Landmark& point = landmarks_.at(id);
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const Observation& o : point.observations) {
    const SE3& camera_from_world = key_frames_.at(o.key_frame).camera_from_world;
    const Eigen::Vector3d ray = point.position - camera_from_world.inverse().translation();
    normal += ray.normalized();
  }
  point.normal = normal.normalized().cast<float>();
  const Observation& newest = point.observations.back();
  const KeyFrame& reference = key_frames_.at(newest.key_frame);
  const double distance = (reference.camera_from_world * point.position).norm();
  const int level = reference.features->orb.keypoints[newest.feature].level;
  point.max_distance_m = static_cast<float>(distance) * model_->level_scale(level);
  point.min_distance_m = point.max_distance_m / model_->level_scale(model_->levels() - 1);
}

const KeyFrame* Map::key_frame(KeyFrameId id) const {
  const auto it = key_frames_.find(id);
  return it == key_frames_.end() ? nullptr : &it->second;
}

const Landmark* Map::landmark(LandmarkId id) const {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

LandmarkId Map::resolve(LandmarkId id) const {
  while (id.valid() && !landmarks_.contains(id)) {
    const auto it = fused_.find(id);
    id = it == fused_.end() ? LandmarkId() : it->second;
  }
  return id;
}

std::vector<std::pair<LandmarkId, LandmarkId>> Map::recent_fusions() const { return {fused_.begin(), fused_.end()}; }

std::optional<Map::Anchored> Map::anchor_of(KeyFrameId id) const {
  SE3 camera_from_anchor;
  while (true) {
    if (const KeyFrame* k = key_frame(id)) return Anchored{*k, camera_from_anchor};
    const auto it = removed_key_frames_.find(id);
    if (it == removed_key_frames_.end()) return std::nullopt;
    camera_from_anchor = camera_from_anchor * it->second.camera_from_anchor;
    id = it->second.anchor;
  }
}

std::optional<SE3> Map::camera_from_world(KeyFrameId id) const {
  const std::optional<Anchored> anchored = anchor_of(id);
  if (!anchored) return std::nullopt;
  return anchored->camera_from_key_frame * anchored->key_frame.camera_from_world;
}

SubMapId Map::sub_map_of(KeyFrameId id) const {
  const std::optional<Anchored> anchored = anchor_of(id);
  return anchored ? anchored->key_frame.sub_map : SubMapId();
}

std::vector<Covisible> Map::covisible(KeyFrameId id, int min_shared) const {
  std::unordered_map<KeyFrameId, int> counts;
  for (const LandmarkId landmark : key_frames_.at(id).landmarks) {
    if (!landmark.valid()) continue;
    for (const Observation& o : landmarks_.at(landmark).observations)
      if (o.key_frame != id) ++counts[o.key_frame];
  }
  std::vector<Covisible> result;
  for (const auto& [key_frame, shared] : counts)
    if (shared >= min_shared) result.push_back({key_frame, shared});
  std::sort(result.begin(), result.end(), [](const Covisible& a, const Covisible& b) {
    return a.shared != b.shared ? a.shared > b.shared : a.key_frame > b.key_frame;
  });
  return result;
}

std::vector<KeyFrameId> Map::key_frames_of(SubMapId sub_map) const {
  std::vector<KeyFrameId> ids;
  for (const auto& [id, key_frame] : key_frames_)
    if (key_frame.sub_map == sub_map) ids.push_back(id);
  return ids;
}

Map Map::part(SubMapId sub_map) const {
  Map copy(*this);
  std::erase_if(copy.landmarks_, [&](const auto& entry) { return sub_map_of(entry.second) != sub_map; });
  std::erase_if(copy.key_frames_, [&](const auto& entry) { return entry.second.sub_map != sub_map; });
  std::erase_if(copy.sub_maps_, [&](const auto& entry) { return entry.first != sub_map; });
  return copy;
}

std::vector<LandmarkId> Map::landmark_ids(std::optional<SubMapId> sub_map) const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  for (const auto& [id, landmark] : landmarks_)
    if (!sub_map || sub_map_of(landmark) == *sub_map) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<Eigen::Vector3d> Map::landmark_positions(std::optional<SubMapId> sub_map) const {
  std::vector<Eigen::Vector3d> positions;
  for (const LandmarkId id : landmark_ids(sub_map)) positions.push_back(landmarks_.at(id).position);
  return positions;
}

std::vector<LandmarkId> Map::landmarks_of(const std::vector<KeyFrameId>& key_frames) const {
  std::vector<LandmarkId> ids;
  for (const KeyFrameId key_frame : key_frames)
    for (const LandmarkId id : key_frames_.at(key_frame).landmarks)
      if (id.valid()) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

Status Map::check_invariants() const {
  const auto broken = [](std::string what) { return Error{ErrorCode::kInternal, "map invariant broken: " + what}; };
  std::size_t from_key_frames = 0, from_landmarks = 0;
  for (const auto& [id, key_frame] : key_frames_) {
    if (key_frame.id != id) return broken(fmt::format("key frame {} stored under {}", key_frame.id.value, id.value));
    if (!key_frame.camera_from_world.is_finite())
      return broken(fmt::format("key frame {} has a pose that is not finite", id.value));
    const auto first = sub_maps_.find(key_frame.sub_map);
    if (first == sub_maps_.end() || first->second > id)
      return broken(fmt::format("sub-map {} does not know its first key frame {}", key_frame.sub_map.value, id.value));
    if (key_frame.landmarks.size() != key_frame.features->size())
      return broken(fmt::format("key frame {} has {} landmark slots for {} features", id.value,
                                key_frame.landmarks.size(), key_frame.features->size()));
    for (std::size_t i = 0; i < key_frame.landmarks.size(); ++i) {
      if (!key_frame.landmarks[i].valid()) continue;
      ++from_key_frames;
      const Landmark* point = landmark(key_frame.landmarks[i]);
      const Observation expected{id, static_cast<std::uint32_t>(i)};
      if (point == nullptr ||
          std::find(point->observations.begin(), point->observations.end(), expected) == point->observations.end())
        return broken(fmt::format("feature {} of key frame {} names landmark {} which does not know it", i, id.value,
                                  key_frame.landmarks[i].value));
    }
  }
  for (const auto& [id, point] : landmarks_) {
    if (point.id != id) return broken(fmt::format("landmark {} stored under {}", point.id.value, id.value));
    if (point.observations.empty()) return broken(fmt::format("landmark {} is seen by nobody", id.value));
    if (!point.position.allFinite())
      return broken(fmt::format("landmark {} has a position that is not finite", id.value));
    for (std::size_t i = 0; i < point.observations.size(); ++i) {
      ++from_landmarks;
      if (i > 0 && point.observations[i - 1].key_frame >= point.observations[i].key_frame)
        return broken(fmt::format("observations of landmark {} are not ascending by key frame", id.value));
      if (!key_frames_.contains(point.observations[i].key_frame))
        return broken(fmt::format("landmark {} is seen by key frame {} which is gone", id.value,
                                  point.observations[i].key_frame.value));
      if (key_frames_.at(point.observations[i].key_frame).sub_map != sub_map_of(point))
        return broken(fmt::format("landmark {} is seen in two sub-maps", id.value));
    }
  }
  if (from_key_frames != from_landmarks)
    return broken(
        fmt::format("{} observations seen from key frames, {} from landmarks", from_key_frames, from_landmarks));
  return Status::success();
}

}  // namespace semvslam
