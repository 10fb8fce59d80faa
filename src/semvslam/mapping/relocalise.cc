#include "semvslam/mapping/relocalise.h"

#include <algorithm>
#include <utility>

#include "semvslam/mapping/landmark_search.h"
#include "semvslam/solve/pnp.h"

namespace semvslam {
namespace {

constexpr std::size_t kFromIndex = 4;   // key frames for every candidate: words are a coarser measure than descriptors
constexpr std::size_t kSample = 200;    // descriptors that these are compared by
constexpr std::size_t kLeastVotes = 6;  // of them in one key frame; chance gives one or two
constexpr int kFirstNeighbours = 4;     // of a candidate, for a first pose: more would only be more to confuse
constexpr int kLeastFirst = 12;         // landmarks that agree with it
constexpr int kLeastShared = 15;        // landmarks that make key frames neighbours

MatchOptions matching(const RelocaliseOptions& options) {
  return {.max_distance = options.max_distance_bits, .ratio = 0.8f, .check_rotation = false};
}

bool among(const std::vector<KeyFrameId>& key_frames, KeyFrameId id) {
  return std::ranges::find(key_frames, id) != key_frames.end();
}

bool holds(const SearchScope& scope, const KeyFrame& key_frame) {
  return key_frame.id < scope.before && key_frame.sub_map != scope.without &&
         (!scope.within.valid() || key_frame.sub_map == scope.within) && !among(scope.apart_from, key_frame.id);
}

/// Key frames by how many of the sample they hold, most first.
std::vector<KeyFrameId> most_alike(const Map& map, const PlaceIndex& places, const FrameFeatures& features,
                                   const RelocaliseOptions& options, const SearchScope& scope) {
  const auto candidates = static_cast<std::size_t>(options.candidates);
  std::vector<Descriptor> sample;
  const std::size_t step = std::max<std::size_t>(1, features.size() / kSample);
  for (std::size_t i = 0; i < features.size(); i += step) sample.push_back(features.orb.descriptors[i]);
  std::vector<std::pair<std::size_t, KeyFrameId>> votes;
  std::vector<Match> matches;
  std::size_t compared = 0;
  for (const PlaceScore& place : places.query(features.orb.descriptors)) {
    if (compared == kFromIndex * candidates) break;
    if (!holds(scope, *map.key_frame(place.key_frame))) continue;
    ++compared;
    if (!scope.apart_from.empty() && std::ranges::any_of(map.covisible(place.key_frame, kLeastShared),
                                                         [&](auto& c) { return among(scope.apart_from, c.key_frame); }))
      continue;
    match_brute_force(sample, landmark_descriptors(*map.key_frame(place.key_frame)), matching(options), matches);
    if (matches.size() >= kLeastVotes) votes.emplace_back(matches.size(), place.key_frame);
  }
  std::sort(votes.rbegin(), votes.rend());  // of equal ones the newer first
  if (votes.size() > candidates) votes.resize(candidates);
  std::vector<KeyFrameId> out;
  for (const auto& [count, id] : votes) out.push_back(id);
  return out;
}

std::vector<LandmarkId> landmarks_around(const Map& map, KeyFrameId id, int neighbours, const SearchScope& scope) {
  std::vector<KeyFrameId> key_frames{id};
  for (const Covisible& c : map.covisible(id, kLeastShared)) {
    if (key_frames.size() > static_cast<std::size_t>(neighbours)) break;
    if (c.key_frame < scope.before) key_frames.push_back(c.key_frame);
  }
  return landmarks_before(map, key_frames, scope.before);
}

/// By descriptors alone.
std::optional<SE3> first_pose(const Map& map, const FrameFeatures& features, KeyFrameId id,
                              const RelocaliseOptions& options, const SearchScope& scope) {
  const std::vector<LandmarkId> landmarks = landmarks_around(map, id, kFirstNeighbours, scope);
  std::vector<Descriptor> descriptors;
  for (const LandmarkId l : landmarks) descriptors.push_back(map.landmark(l)->descriptor);
  std::vector<Match> matches;
  match_brute_force(descriptors, features.orb.descriptors, matching(options), matches);
  const LandmarkMatches pairs = pair_up(map, features, landmarks, matches);
  const Result<PnpEstimate> estimate =
      estimate_pose(map.model().intrinsics(), pairs.points, pairs.observations,
                    {.min_inliers = kLeastFirst, .refinement = {.chi2_disparity = map.model().chi2_disparity()}});
  if (!estimate) return std::nullopt;
  return estimate->pose.camera_from_world;
}

/// Searches everything that should be seen from there.
std::optional<Relocalisation> confirm(const Map& map, const FrameFeatures& features, KeyFrameId id, const SE3& pose,
                                      const RelocaliseOptions& options, const SearchScope& scope) {
  const LandmarkMatches pairs = search_landmarks(
      map, features, pose, landmarks_around(map, id, options.neighbours, scope), options.radius_px, matching(options));
  std::vector<std::uint8_t> inlier;
  const PoseEstimate estimate = optimize_pose(map.model().intrinsics(), pose, pairs.points, pairs.observations,
                                              {.chi2_disparity = map.model().chi2_disparity()}, inlier);
  if (estimate.inliers < options.min_inliers ||
      estimate.inliers < options.min_share * static_cast<double>(pairs.size()) ||
      estimate.inliers < options.min_seen_share * static_cast<double>(pairs.in_view))
    return std::nullopt;
  Relocalisation found{id, estimate.camera_from_world, std::vector<LandmarkId>(features.size()), estimate.inliers};
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (inlier[i]) found.landmarks[pairs.features[i]] = pairs.landmarks[i];
  return found;
}

}  // namespace

std::vector<std::pair<LandmarkId, std::uint32_t>> Relocalisation::matches() const {
  std::vector<std::pair<LandmarkId, std::uint32_t>> out;
  for (std::uint32_t f = 0; f < landmarks.size(); ++f)
    if (landmarks[f].valid()) out.emplace_back(landmarks[f], f);
  return out;
}

void RelocaliseOptions::add_to(ConfigSchema& s) {
  s.add("mapping.relocalise.enabled", &enabled, "a frame that got lost is looked for in the whole map");
  s.add("mapping.relocalise.candidates", &candidates, {1, 1000},
        "key frames that look most like it, tried one after the other");
  s.add("mapping.relocalise.max_distance_bits", &max_distance_bits, {1, 256},
        "descriptors that differ in more bits are no match");
  s.add("mapping.relocalise.radius_px", &radius_px, {0.5, 100},
        "search window at level 0 once there is a first pose, px");
  s.add("mapping.relocalise.neighbours", &neighbours, {0, 1000},
        "neighbours of the key frame, whose landmarks are searched then");
  s.add("mapping.relocalise.min_inliers", &min_inliers, {6, 10000}, "landmarks that must agree with the pose");
  s.add("mapping.relocalise.min_share", &min_share, {0, 1}, "share of the landmarks found that must agree");
  s.add("mapping.relocalise.min_seen_share", &min_seen_share, {0, 1},
        "share of the landmarks that should be in view that must agree");
}

std::optional<Relocalisation> relocalise(const Map& map, const PlaceIndex& places, const FrameFeatures& features,
                                         const RelocaliseOptions& options, const SearchScope& scope) {
  for (const KeyFrameId id : most_alike(map, places, features, options, scope))
    if (const std::optional<SE3> pose = first_pose(map, features, id, options, scope))
      if (std::optional<Relocalisation> found = confirm(map, features, id, *pose, options, scope)) return found;
  return std::nullopt;
}

}  // namespace semvslam
