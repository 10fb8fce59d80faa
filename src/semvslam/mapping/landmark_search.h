#pragma once

#include <cstdint>
#include <vector>

#include "semvslam/feature/matching.h"
#include "semvslam/map/map.h"

namespace semvslam {

/// Landmarks and the features of a frame that they were matched to, as the pose solvers want them.
struct LandmarkMatches {
  std::vector<LandmarkId> landmarks;
  std::vector<std::uint32_t> features;
  std::vector<Eigen::Vector3d> points;  // world, metres
  std::vector<PointObservation> observations;
  std::size_t in_view = 0;  // landmarks that should have been seen, found or not; search_landmarks() only

  std::size_t size() const { return landmarks.size(); }
};

/// The first of so many newest key frames of its sub-map up to `id`: what none of them sees belongs to an earlier
/// visit.
KeyFrameId first_recent(const Map& map, KeyFrameId id, int newest);
/// Landmarks of the key frames that no key frame from `before` on sees.
std::vector<LandmarkId> landmarks_before(const Map& map, const std::vector<KeyFrameId>& key_frames, KeyFrameId before);
/// Descriptors of the features that are landmarks.
std::vector<Descriptor> landmark_descriptors(const KeyFrame& key_frame);

/// @param sources the landmark of each query.
LandmarkMatches pair_up(const Map& map, const FrameFeatures& frame, const std::vector<LandmarkId>& sources,
                        const std::vector<Match>& matches);

/// Searches landmarks where a camera at that pose should see them. @param radius_px at level 0.
LandmarkMatches search_landmarks(const Map& map, const FrameFeatures& frame, const SE3& camera_from_world,
                                 const std::vector<LandmarkId>& landmarks, double radius_px,
                                 const MatchOptions& options);

}  // namespace semvslam
