#include "semvslam/mapping/landmark_search.h"

#include "semvslam/map/landmark_view.h"

namespace semvslam {

KeyFrameId first_recent(const Map& map, KeyFrameId id, int newest) {
  const SubMapId sub_map = map.key_frame(id)->sub_map;
  KeyFrameId first = id;
  for (auto it = map.key_frames().find(id); newest > 0 && it != map.key_frames().begin();) {
    --it;
    if (it->second.sub_map == sub_map) first = it->first, --newest;
  }
  return first;
}

std::vector<LandmarkId> landmarks_before(const Map& map, const std::vector<KeyFrameId>& key_frames, KeyFrameId before) {
  std::vector<LandmarkId> landmarks = map.landmarks_of(key_frames);
  std::erase_if(landmarks, [&](LandmarkId l) { return map.landmark(l)->observations.back().key_frame >= before; });
  return landmarks;
}

std::vector<Descriptor> landmark_descriptors(const KeyFrame& key_frame) {
  std::vector<Descriptor> descriptors;
  for (std::size_t i = 0; i < key_frame.landmarks.size(); ++i)
    if (key_frame.landmarks[i].valid()) descriptors.push_back(key_frame.features->orb.descriptors[i]);
  return descriptors;
}

LandmarkMatches pair_up(const Map& map, const FrameFeatures& frame, const std::vector<LandmarkId>& sources,
                        const std::vector<Match>& matches) {
  LandmarkMatches out;
  for (const Match& m : matches) {
    out.landmarks.push_back(sources[static_cast<std::size_t>(m.query)]);
    out.features.push_back(static_cast<std::uint32_t>(m.feature));
    out.points.push_back(map.landmark(out.landmarks.back())->position);
    out.observations.push_back(map.model().observation(frame, out.features.back()));
  }
  return out;
}

LandmarkMatches search_landmarks(const Map& map, const FrameFeatures& frame, const SE3& camera_from_world,
                                 const std::vector<LandmarkId>& landmarks, double radius_px,
                                 const MatchOptions& options) {
  const LandmarkViewer viewer(map.model(), camera_from_world);
  std::vector<ProjectedQuery> queries;
  std::vector<LandmarkId> sources;
  for (const LandmarkId l : landmarks) {
    const Landmark& landmark = *map.landmark(l);
    const std::optional<LandmarkView> view =
        viewer.view({landmark.position, landmark.normal, landmark.min_distance_m, landmark.max_distance_m});
    if (!view) continue;
    queries.push_back(query_of(map.model(), *view, radius_px, landmark.descriptor));
    sources.push_back(l);
  }
  std::vector<Match> matches;
  match_projected(queries, frame.orb, frame.grid, options, matches);
  LandmarkMatches pairs = pair_up(map, frame, sources, matches);
  pairs.in_view = sources.size();
  return pairs;
}

}  // namespace semvslam
