#include "semvslam/map/frame_features.h"

#include <algorithm>
#include <cmath>

#include "semvslam/geometry/depth_image.h"

namespace semvslam {
namespace {

// 0 unless the centre was measured and what was measured around it lies on the same smooth surface.
float smooth_depth_m(const cv::Mat& depth, float metres_per_unit, float edge_ratio, int radius, int x, int y) {
  const float centre = depth_at_m(depth, metres_per_unit, x, y);
  if (centre <= 0.f) return 0.f;
  float low = centre, high = centre;
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const int nx = x + dx, ny = y + dy;
      if (nx < 0 || ny < 0 || nx >= depth.cols || ny >= depth.rows) continue;
      const float d = depth_at_m(depth, metres_per_unit, nx, ny);
      if (d <= 0.f) continue;
      low = std::min(low, d);
      high = std::max(high, d);
    }
  }
  return high - low > edge_ratio * centre ? 0.f : centre;
}

}  // namespace

ObservationModel::ObservationModel(const Camera& camera, const NoiseModel& noise, std::vector<float> level_scales)
    : camera_(camera), intrinsics_(Intrinsics::of(camera)), noise_(noise), level_scales_(std::move(level_scales)) {
  for (const float scale : level_scales_) {
    const double sigma_px = noise.pixel_sigma_px * scale;
    inverse_variance_px_.push_back(1.0 / (sigma_px * sigma_px));
  }
  inverse_variance_disparity_ = noise.disparity_weight / (noise.disparity_sigma_px * noise.disparity_sigma_px);
  inverse_log_factor_ = level_scales_.size() > 1 ? 1.f / std::log(level_scales_[1] / level_scales_[0]) : 0.f;
}

PointObservation ObservationModel::observation(const FrameFeatures& features, std::size_t i) const {
  PointObservation o;
  o.pixel = {features.x_px[i], features.y_px[i]};
  o.inverse_variance_px = inverse_variance_px(features.orb.keypoints[i].level);
  if (features.has_depth(i)) {
    o.disparity_px = intrinsics_.focal_baseline_px_m / features.depth_m[i];
    o.inverse_variance_disparity = inverse_variance_disparity_;
  }
  return o;
}

Eigen::Vector3d ObservationModel::back_project(const FrameFeatures& features, std::size_t i) const {
  return camera_.back_project({features.x_px[i], features.y_px[i]}, features.depth_m[i]);
}

int ObservationModel::predict_level(float max_distance_over_distance) const {
  const int level = static_cast<int>(std::lround(std::log(max_distance_over_distance) * inverse_log_factor_));
  return std::clamp(level, 0, levels() - 1);
}

void measure(const ObservationModel& model, const cv::Mat& depth, FrameFeatures& features) {
  const Camera& camera = model.camera();
  const NoiseModel& noise = model.noise();
  const std::size_t n = features.orb.size();
  features.x_px.resize(n);
  features.y_px.resize(n);
  features.depth_m.assign(n, 0.f);
  const bool distorted = !camera.distortion.is_zero();
  const auto metres_per_unit = static_cast<float>(1.0 / camera.depth_units_per_m);
  for (std::size_t i = 0; i < n; ++i) {
    const Keypoint& k = features.orb.keypoints[i];
    features.x_px[i] = k.x_px;
    features.y_px[i] = k.y_px;
    if (distorted) {
      const Eigen::Vector2d ideal = camera.undistort({k.x_px, k.y_px});
      features.x_px[i] = static_cast<float>(ideal.x());
      features.y_px[i] = static_cast<float>(ideal.y());
    }
    if (depth.empty()) continue;
    const int x = std::clamp(static_cast<int>(std::lround(k.x_px)), 0, depth.cols - 1);
    const int y = std::clamp(static_cast<int>(std::lround(k.y_px)), 0, depth.rows - 1);
    // A corner's place is uncertain by a pixel of its own level: with a 3x3 window on all levels, coarse corners of an
    // object's edge got the depth of what lies behind it, and the whole trajectory came out 0.2 % too large.
    const int radius = static_cast<int>(std::lround(model.level_scale(k.level)));
    const float d = smooth_depth_m(depth, metres_per_unit, static_cast<float>(noise.depth_edge_ratio), radius, x, y);
    if (d >= noise.min_depth_m && d <= noise.max_depth_m) features.depth_m[i] = d;
  }
  features.grid.build(features.x_px, features.y_px, camera.width_px, camera.height_px);
}

void keep_features(const std::vector<std::uint8_t>& keep, const Camera& camera, FrameFeatures& features) {
  if (std::find(keep.begin(), keep.end(), std::uint8_t{0}) == keep.end()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (keep[i] == 0) continue;
    features.orb.keypoints[kept] = features.orb.keypoints[i];
    features.orb.descriptors[kept] = features.orb.descriptors[i];
    features.x_px[kept] = features.x_px[i];
    features.y_px[kept] = features.y_px[i];
    features.depth_m[kept] = features.depth_m[i];
    ++kept;
  }
  features.orb.keypoints.resize(kept);
  features.orb.descriptors.resize(kept);
  features.x_px.resize(kept);
  features.y_px.resize(kept);
  features.depth_m.resize(kept);
  features.grid.build(features.x_px, features.y_px, camera.width_px, camera.height_px);
}

}  // namespace semvslam
