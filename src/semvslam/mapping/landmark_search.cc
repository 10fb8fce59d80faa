#include "semvslam/mapping/landmark_search.h"

#include "semvslam/map/landmark_view.h"

namespace semvslam {

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
