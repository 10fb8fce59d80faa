#include "semvslam/mapping/mapper.h"

#include <algorithm>
#include <chrono>
#include <unordered_set>

#include "semvslam/map/landmark_view.h"
#include "semvslam/mapping/landmark_search.h"

namespace semvslam {
namespace {

using Clock = std::chrono::steady_clock;

double lap_ms(Clock::time_point& start) {
  const Clock::time_point now = Clock::now();
  const double ms = std::chrono::duration<double, std::milli>(now - start).count();
  start = now;
  return ms;
}

}  // namespace

Mapper::Mapper(const MappingOptions& options, Map map)
    : options_(options),
      map_(std::move(map)),
      loop_finder_(options.loop),
      join_finder_(options.sub_maps, options.relocalise, options.loop) {
  for (const auto& [id, key_frame] : map_.key_frames()) places_.add(id, landmark_descriptors(key_frame));
}

std::shared_ptr<const LocalMap> Mapper::step(const NewKeyFrame& key_frame, std::stop_token stop) {
  const Clock::time_point begin = Clock::now();
  Clock::time_point lap = begin;
  times_ = {};
  const KeyFrameId id = insert(key_frame);
  cull_landmarks(id);
  create_landmarks(id);
  times_.create_ms = lap_ms(lap);
  places_.add(id, landmark_descriptors(*map_.key_frame(id)));
  join(id);
  times_.join_ms = lap_ms(lap);
  const int revisits = revisits_;
  if (options_.revisit.enabled && !joined_) {
    if (const std::optional<Revisit> revisit = find_revisit(map_, id, options_.revisit))
      revisits_ += close_revisit(map_, id, *revisit);
    times_.revisit_ms = lap_ms(lap);
  }
  if (options_.loop.enabled && !joined_ && revisits_ == revisits) {
    if (const std::optional<Revisit> loop = loop_finder_.find(map_, places_, id))
      loops_ += close_revisit(map_, id, *loop);
    times_.loop_ms = lap_ms(lap);
  }
  if (!is_first(id)) {
    if (joined_) adjust_joined(stop);
    fuse_with_neighbours(id);
    times_.fuse_ms = lap_ms(lap);
    adjust_neighbourhood(id, stop);
    times_.bundle_ms = lap_ms(lap);
    if (!joined_) cull_key_frames(id);  // tracking finds its way into the other world by the key frames that it knows
    times_.cull_ms = lap_ms(lap);
  }
  std::shared_ptr<const LocalMap> local = make_local_map(map_, id, options_.local_map);
  lap = begin;
  times_.total_ms = lap_ms(lap);
  return local;
}

void Mapper::join(KeyFrameId id) {
  joined_.reset();
  const std::vector<Sighting> sightings = join_finder_.find(map_, places_, id);
  if (sightings.empty()) return;
  joined_ = join_sub_maps(map_, sightings);
  ++joins_;
  loop_finder_ = LoopFinder(options_.loop);  // what it found was in another world
}

KeyFrameId Mapper::insert(const NewKeyFrame& key_frame) {
  // Whether the young landmarks of a place that was left for another world are found again nobody will see: they stay.
  const auto& all = map_.key_frames();
  if (!all.empty() && all.rbegin()->second.sub_map != key_frame.sub_map) young_.clear();
  const KeyFrameId id = map_.add_key_frame(key_frame.frame, key_frame.stamp, key_frame.camera_from_world,
                                           key_frame.features, key_frame.sub_map);
  for (std::size_t i = 0; i < key_frame.landmarks.size(); ++i) {
    const LandmarkId landmark = map_.resolve(key_frame.landmarks[i]);
    if (landmark.valid() && map_.add_observation(landmark, id, static_cast<std::uint32_t>(i)))
      map_.refresh_landmark(landmark);
  }
  return id;
}

void Mapper::create_landmarks(KeyFrameId id) {
  const KeyFrame& key_frame = *map_.key_frame(id);
  const FrameFeatures& features = *key_frame.features;
  const SE3 world_from_camera = key_frame.camera_from_world.inverse();
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (key_frame.landmarks[i].valid() || !features.has_depth(i)) continue;
    if (features.depth_m[i] > options_.max_landmark_depth_m) continue;
    const Eigen::Vector3d in_world = world_from_camera * map_.model().back_project(features, i);
    young_.push_back(map_.add_landmark(in_world, id, static_cast<std::uint32_t>(i)));
  }
}

void Mapper::cull_landmarks(KeyFrameId newest) {
  std::size_t kept = 0;
  for (const LandmarkId id : young_) {
    const Landmark* landmark = map_.landmark(id);
    if (landmark == nullptr) continue;
    const int age = static_cast<int>(newest.value - landmark->first_key_frame.value);
    const bool seldom_found = landmark->found < options_.min_found_ratio * landmark->visible;
    const bool alone = age >= options_.young_key_frames && landmark->observations.size() < 3;
    if (seldom_found || alone) {
      map_.remove_landmark(id);
      continue;
    }
    if (age < options_.young_key_frames) young_[kept++] = id;
  }
  young_.resize(kept);
}

void Mapper::count_use(LandmarkId id, int visible, int found, int seen_through) {
  const LandmarkId landmark = map_.resolve(id);
  if (!landmark.valid()) return;
  if (seen_through >= options_.seen_through && seen_through > found)
    map_.remove_landmark(landmark);
  else
    map_.count_visible(landmark, visible, found);
}

std::vector<KeyFrameId> Mapper::fusion_partners(KeyFrameId id) const {
  std::vector<KeyFrameId> partners;
  for (const Covisible& c : map_.covisible(id, options_.min_shared)) {
    if (partners.size() >= static_cast<std::size_t>(options_.fuse_key_frames)) break;
    partners.push_back(c.key_frame);
  }
  // Key frames of an earlier visit share no landmark yet: that is what fusing them is for.
  for (const KeyFrameId near : nearby_key_frames(map_, id, options_.local_map, partners)) {
    if (partners.size() >= static_cast<std::size_t>(options_.fuse_key_frames + options_.local_map.nearby_key_frames))
      break;
    partners.push_back(near);
  }
  return partners;
}

void Mapper::fuse_with_neighbours(KeyFrameId id) {
  const std::vector<KeyFrameId> partners = fusion_partners(id);
  std::vector<LandmarkId> own;
  for (const LandmarkId landmark : map_.key_frame(id)->landmarks)
    if (landmark.valid()) own.push_back(landmark);
  for (const KeyFrameId partner : partners) fuse_into(own, partner);
  fuse_into(map_.landmarks_of(partners), id);
  for (const LandmarkId landmark : map_.key_frame(id)->landmarks)
    if (landmark.valid()) map_.refresh_landmark(landmark);
}

void Mapper::adjust_joined(std::stop_token stop) {
  adjust_all_of(joined_->into, stop);
  for (const KeyFrameId id : joined_->moved) fuse_with_neighbours(id);
  adjust_all_of(joined_->into, stop);
}

void Mapper::fuse_into(const std::vector<LandmarkId>& landmarks, KeyFrameId target) {
  const KeyFrame& key_frame = *map_.key_frame(target);
  const FrameFeatures& features = *key_frame.features;
  const ObservationModel& model = map_.model();
  const Camera& camera = model.camera();
  const LandmarkViewer viewer(model, key_frame.camera_from_world);
  std::unordered_set<LandmarkId> seen(key_frame.landmarks.begin(), key_frame.landmarks.end());
  std::vector<LandmarkId> sources;
  std::vector<Eigen::Vector3d> in_camera;
  queries_.clear();
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map_.landmark(id);
    if (landmark == nullptr || seen.contains(id)) continue;
    const std::optional<LandmarkView> view =
        viewer.view({landmark->position, landmark->normal, landmark->min_distance_m, landmark->max_distance_m});
    if (!view) continue;
    queries_.push_back(query_of(model, *view, options_.fuse_radius_px, landmark->descriptor));
    sources.push_back(id);
    in_camera.push_back(view->in_camera);
  }
  match_projected(queries_, features.orb, features.grid, {.max_distance = 50, .ratio = 1.f, .check_rotation = false},
                  matches_);
  for (const Match& m : matches_) {
    const auto q = static_cast<std::size_t>(m.query);
    const auto f = static_cast<std::size_t>(m.feature);
    const PointObservation o = model.observation(features, f);
    if ((camera.project(in_camera[q]) - o.pixel).squaredNorm() * o.inverse_variance_px > 5.991) continue;
    if (o.disparity_px > 0) {
      const double residual = o.disparity_px - model.intrinsics().focal_baseline_px_m / in_camera[q].z();
      if (residual * residual * o.inverse_variance_disparity > 2 * model.chi2_disparity()) continue;
    }
    const LandmarkId existing = key_frame.landmarks[f];
    if (!existing.valid()) {
      map_.add_observation(sources[q], target, static_cast<std::uint32_t>(f));
      continue;
    }
    const Landmark* a = map_.landmark(sources[q]);
    const Landmark* b = map_.landmark(existing);
    if (a == nullptr || a == b) continue;
    // The one that more key frames know survives.
    if (a->observations.size() > b->observations.size())
      map_.fuse_landmarks(existing, sources[q]);
    else
      map_.fuse_landmarks(sources[q], existing);
  }
}

void Mapper::adjust_all_of(SubMapId sub_map, std::stop_token stop) {
  const std::vector<KeyFrameId> window = map_.key_frames_of(sub_map);
  if (window.size() < 2 || window.back() < map_.first_of_session()) return;
  // What bends a whole map (drift that a revisit has spread) gains little per step: five steps would leave most of it.
  adjust(window, {.robust_iterations = 25, .final_iterations = 15, .relative_cost_tolerance = 1e-6}, stop);
}

void Mapper::adjust_all(std::stop_token stop) {
  for (const auto& [sub_map, first] : map_.sub_maps()) adjust_all_of(sub_map, stop);
}

void Mapper::adjust_neighbourhood(KeyFrameId id, std::stop_token stop) {
  std::vector<KeyFrameId> window{id};
  for (const Covisible& c : map_.covisible(id, options_.min_shared)) {
    if (window.size() >= static_cast<std::size_t>(options_.bundle_key_frames)) break;
    window.push_back(c.key_frame);
  }
  adjust(window, {}, stop);
}

void Mapper::adjust(const std::vector<KeyFrameId>& window, BaOptions options, std::stop_token stop) {
  const std::vector<LandmarkId> landmarks = map_.landmarks_of(window);

  // Key frames outside the window that see its landmarks hold the window in place; those that see most are taken.
  std::map<KeyFrameId, int> outside;
  for (const LandmarkId l : landmarks)
    for (const Observation& o : map_.landmark(l)->observations)
      if (std::find(window.begin(), window.end(), o.key_frame) == window.end()) ++outside[o.key_frame];
  std::vector<std::pair<int, KeyFrameId>> ranked;
  for (const auto& [key_frame, count] : outside) ranked.emplace_back(count, key_frame);
  std::sort(ranked.begin(), ranked.end(),
            [](const auto& a, const auto& b) { return a.first != b.first ? a.first > b.first : a.second > b.second; });
  if (ranked.size() > static_cast<std::size_t>(options_.bundle_fixed_key_frames))
    ranked.resize(static_cast<std::size_t>(options_.bundle_fixed_key_frames));

  BaProblem problem;
  problem.camera = map_.model().intrinsics();
  std::map<KeyFrameId, std::uint32_t> index_of;
  const auto add_pose = [&](KeyFrameId k, bool fixed) {
    index_of[k] = static_cast<std::uint32_t>(problem.poses.size());
    problem.poses.push_back(map_.key_frame(k)->camera_from_world);
    problem.pose_fixed.push_back(fixed ? 1 : 0);
  };
  for (const KeyFrameId k : window)
    add_pose(k, is_first(k) || (ranked.empty() && k == *std::min_element(window.begin(), window.end())));
  for (const auto& [count, k] : ranked) add_pose(k, true);
  std::vector<Observation> edge_source;
  std::vector<LandmarkId> edge_landmark;
  for (const LandmarkId l : landmarks) {
    const Landmark& landmark = *map_.landmark(l);
    const auto point = static_cast<std::uint32_t>(problem.points.size());
    problem.points.push_back(landmark.position);
    for (const Observation& o : landmark.observations) {
      const auto it = index_of.find(o.key_frame);
      if (it == index_of.end()) continue;
      problem.edges.push_back(
          {it->second, point, map_.model().observation(*map_.key_frame(o.key_frame)->features, o.feature)});
      edge_source.push_back(o);
      edge_landmark.push_back(l);
    }
  }
  std::vector<std::uint8_t> edge_inlier;
  options.chi2_disparity = map_.model().chi2_disparity();
  const BaSummary summary = adjust_bundle(problem, options, edge_inlier, stop);
  if (!summary.usable) return;
  for (const KeyFrameId k : window) map_.set_pose(k, problem.poses[index_of.at(k)]);
  for (std::size_t i = 0; i < landmarks.size(); ++i) map_.set_position(landmarks[i], problem.points[i]);
  for (std::size_t e = 0; e < edge_inlier.size(); ++e)
    if (!edge_inlier[e]) map_.remove_observation(edge_landmark[e], edge_source[e].key_frame);
  for (const LandmarkId l : landmarks)
    if (map_.landmark(l) != nullptr) map_.refresh_geometry(l);
}

bool Mapper::is_redundant(const KeyFrame& key_frame) const {
  int seen = 0, redundant = 0;
  for (std::size_t i = 0; i < key_frame.landmarks.size(); ++i) {
    if (!key_frame.landmarks[i].valid()) continue;
    const Landmark& landmark = *map_.landmark(key_frame.landmarks[i]);
    ++seen;
    if (landmark.observations.size() <= 3) continue;
    int others = 0;
    for (const Observation& o : landmark.observations) {
      if (o.key_frame == key_frame.id) continue;
      // An observation on a coarser level is no full substitute.
      if (map_.key_frame(o.key_frame)->features->orb.keypoints[o.feature].level <=
          key_frame.features->orb.keypoints[i].level + 1)
        ++others;
      if (others >= 3) break;
    }
    redundant += others >= 3;
  }
  return redundant > options_.redundant_ratio * seen;
}

void Mapper::cull_key_frames(KeyFrameId newest) {
  for (const Covisible& c : map_.covisible(newest, options_.min_shared)) {
    if (is_first(c.key_frame) || c.key_frame == newest) continue;
    if (!is_redundant(*map_.key_frame(c.key_frame))) continue;
    const std::vector<Covisible> neighbours = map_.covisible(c.key_frame, 1);
    places_.remove(c.key_frame);
    map_.remove_key_frame(c.key_frame, neighbours.empty() ? newest : neighbours.front().key_frame);
  }
}

}  // namespace semvslam
