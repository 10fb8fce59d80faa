#include "semvslam/mapping/revisit.h"

#include <algorithm>
#include <map>

#include "semvslam/base/ranked.h"
#include "semvslam/mapping/landmark_search.h"
#include "semvslam/solve/pnp.h"
#include "semvslam/solve/pose_graph.h"

namespace semvslam {
namespace {

constexpr int kStrongLink = 60;  // landmarks that key frames far apart in time must share to hold each other
/// Neighbours hold each other many times over, by links to every key frame around; one link must outweigh them all.
constexpr double kRevisitWeight = 1000;

/// Key frames before the newest `recent`, the ones nearest to `id` in place and direction.
std::vector<KeyFrameId> earlier_key_frames(const Map& map, KeyFrameId id, KeyFrameId first_recent,
                                           const RevisitOptions& options) {
  std::vector<KeyFrameId> recent;
  for (auto it = map.key_frames().lower_bound(first_recent); it != map.key_frames().end(); ++it)
    recent.push_back(it->first);
  return nearby_key_frames(map, id,
                           {.nearby_key_frames = options.key_frames,
                            .nearby_distance_m = options.distance_m,
                            .nearby_angle_deg = options.angle_deg},
                           recent);
}

PoseGraphProblem::Edge edge(std::uint32_t a, std::uint32_t b, const SE3& a_from_b, double landmarks) {
  // As if every landmark said 1 cm and 0.3 deg of the relative pose: only the proportions matter.
  PoseGraphProblem::Edge e{a, b, a_from_b};
  e.information.diagonal() << 1e4, 1e4, 1e4, 4e4, 4e4, 4e4;
  e.information *= landmarks;
  return e;
}

/// Poses of all key frames of a sub-map (world_from_camera) with the links that hold them; index by key frame.
PoseGraphProblem essential_graph(const Map& map, SubMapId sub_map, std::map<KeyFrameId, std::uint32_t>& index_of) {
  PoseGraphProblem graph;
  const std::vector<KeyFrameId> key_frames = map.key_frames_of(sub_map);
  for (const KeyFrameId id : key_frames) {
    index_of[id] = static_cast<std::uint32_t>(graph.world_from_pose.size());
    graph.world_from_pose.push_back(map.key_frame(id)->camera_from_world.inverse());
    graph.fixed.push_back(graph.fixed.empty() ? 1 : 0);
  }
  const auto link = [&](KeyFrameId a, KeyFrameId b, int shared) {
    graph.edges.push_back(edge(index_of.at(a), index_of.at(b),
                               map.key_frame(a)->camera_from_world * map.key_frame(b)->camera_from_world.inverse(),
                               std::max(shared, 1)));
  };
  KeyFrameId previous;
  for (const KeyFrameId id : key_frames) {
    int with_previous = 0;
    for (const Covisible& c : map.covisible(id, 1)) {
      if (c.key_frame == previous) with_previous = c.shared;
      if (c.key_frame < id && c.key_frame != previous && c.shared >= kStrongLink) link(c.key_frame, id, c.shared);
    }
    if (previous.valid()) link(previous, id, with_previous);
    previous = id;
  }
  return graph;
}

}  // namespace

void RevisitOptions::add_to(ConfigSchema& s) {
  s.add("mapping.revisit.enabled", &enabled,
        "earlier visits of a place are recognised and drift since then is removed");
  s.add("mapping.revisit.recent_key_frames", &recent_key_frames, {1, 1000},
        "landmarks that none of so many newest key frames sees belong to an earlier visit");
  s.add("mapping.revisit.key_frames", &key_frames, {1, 1000}, "key frames of it whose landmarks are searched");
  s.add("mapping.revisit.distance_m", &distance_m, {0, 100}, "between the camera then and now, m");
  s.add("mapping.revisit.angle_deg", &angle_deg, {0, 180}, "between the viewing directions, degrees");
  s.add("mapping.revisit.radius_px", &radius_px, {1, 200}, "search window at level 0, px");
  s.add("mapping.revisit.min_inliers", &min_inliers, {6, 10000}, "landmarks that must agree with one pose");
  s.add("mapping.revisit.min_share", &min_share, {0, 1}, "share of the landmarks found that must agree");
  s.add("mapping.revisit.least_shift_px", &least_shift_px, {0, 100}, "less of a correction is left to fusion, px");
}

double median_shift_px(const Map& map, KeyFrameId id, const Revisit& revisit) {
  const Camera& camera = map.model().camera();
  const SE3& now = map.key_frame(id)->camera_from_world;
  std::vector<double> shifts;
  for (const auto& [landmark, feature] : revisit.matches) {
    const Eigen::Vector3d& p = map.landmark(landmark)->position;
    const Eigen::Vector3d drifted = now * p;
    // Behind the camera that has drifted so far: as much as a whole image.
    shifts.push_back(drifted.z() <= 0
                         ? camera.width_px
                         : (camera.project(drifted) - camera.project(revisit.camera_from_world * p)).norm());
  }
  return median(std::span(shifts));
}

std::optional<Revisit> find_revisit(const Map& map, KeyFrameId id, const RevisitOptions& options) {
  const KeyFrame& key_frame = *map.key_frame(id);
  const KeyFrameId recent = first_recent(map, id, options.recent_key_frames);
  const std::vector<KeyFrameId> earlier = earlier_key_frames(map, id, recent, options);
  if (earlier.empty()) return std::nullopt;

  const std::vector<LandmarkId> landmarks = landmarks_before(map, earlier, recent);
  const LandmarkMatches pairs =
      search_landmarks(map, *key_frame.features, key_frame.camera_from_world, landmarks, options.radius_px,
                       {.max_distance = 50, .ratio = 0.8f, .check_rotation = false});
  if (pairs.size() < static_cast<std::size_t>(options.min_inliers)) return std::nullopt;
  const Result<PnpEstimate> estimate = estimate_pose(
      map.model().intrinsics(), pairs.points, pairs.observations,
      {.min_inliers = options.min_inliers, .refinement = {.chi2_disparity = map.model().chi2_disparity()}});
  if (!estimate || estimate->pose.inliers < options.min_share * static_cast<double>(pairs.size())) return std::nullopt;
  Revisit revisit{earlier.front(), estimate->pose.camera_from_world, {}, 0};
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (estimate->inlier[i]) revisit.matches.emplace_back(pairs.landmarks[i], pairs.features[i]);
  if (revisit.matches.empty()) return std::nullopt;
  revisit.shift_px = median_shift_px(map, id, revisit);
  if (revisit.shift_px < options.least_shift_px) return std::nullopt;
  return revisit;
}

void fuse_matches(Map& map, KeyFrameId id, const std::vector<std::pair<LandmarkId, std::uint32_t>>& matches) {
  for (const auto& [landmark, feature] : matches) {
    if (map.landmark(landmark) == nullptr) continue;  // fused into another just now
    const LandmarkId existing = map.key_frame(id)->landmarks[feature];
    if (existing.valid())
      map.fuse_landmarks(existing, landmark);
    else
      map.add_observation(landmark, id, feature);
  }
}

bool close_revisit(Map& map, KeyFrameId id, const Revisit& revisit) {
  const SubMapId sub_map = map.key_frame(id)->sub_map;
  std::map<KeyFrameId, std::uint32_t> index_of;
  PoseGraphProblem graph = essential_graph(map, sub_map, index_of);
  const std::vector<SE3> before = graph.world_from_pose;
  const SE3& earlier_from_world = map.key_frame(revisit.earlier)->camera_from_world;
  graph.edges.push_back(edge(index_of.at(revisit.earlier), index_of.at(id),
                             earlier_from_world * revisit.camera_from_world.inverse(),
                             kRevisitWeight * static_cast<double>(revisit.matches.size())));
  if (!optimize_pose_graph(graph).usable) return false;

  const std::vector<LandmarkId> landmarks = map.landmark_ids(sub_map);
  for (const LandmarkId l : landmarks) {
    const Landmark& landmark = *map.landmark(l);
    // Those of the earlier visit stay with it, whoever saw them since.
    const std::uint32_t k = index_of.at(landmark.observations.front().key_frame);
    map.set_position(l, graph.world_from_pose[k] * (before[k].inverse() * landmark.position));
  }
  for (const auto& [key_frame, k] : index_of) map.set_pose(key_frame, graph.world_from_pose[k].inverse());
  for (const LandmarkId l : landmarks) map.refresh_geometry(l);
  fuse_matches(map, id, revisit.matches);
  return true;
}

}  // namespace semvslam
