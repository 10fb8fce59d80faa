#include "semvslam/map/landmark_view.h"

namespace semvslam {
namespace {

constexpr double kNearestDepth = 0.05;  // metres before the camera
constexpr float kDistanceSlack = 1.2f;  // the pyramid's limits are no sharp ones: half a level more

}  // namespace

ProjectedQuery query_of(const ObservationModel& model, const LandmarkView& view, double radius_px,
                        const Descriptor& descriptor) {
  return {static_cast<float>(view.pixel.x()),
          static_cast<float>(view.pixel.y()),
          static_cast<float>(radius_px) * model.level_scale(view.level),
          view.level - 1,
          view.level + 1,
          descriptor,
          -1.f};
}

std::optional<LandmarkView> LandmarkViewer::view(const LandmarkShape& landmark) const {
  LandmarkView view;
  view.in_camera = camera_from_world_ * landmark.position;
  if (view.in_camera.z() < kNearestDepth) return std::nullopt;
  const Camera& camera = model_.camera();
  view.pixel = camera.project(view.in_camera);
  if (!camera.sees(view.pixel)) return std::nullopt;
  const Eigen::Vector3d ray = landmark.position - centre_;
  const auto distance = static_cast<float>(ray.norm());
  if (distance * kDistanceSlack < landmark.min_distance_m || distance > kDistanceSlack * landmark.max_distance_m)
    return std::nullopt;
  if (ray.dot(landmark.normal.cast<double>()) < min_view_cosine_ * distance) return std::nullopt;
  view.level = model_.predict_level(landmark.max_distance_m / distance);
  return view;
}

}  // namespace semvslam
