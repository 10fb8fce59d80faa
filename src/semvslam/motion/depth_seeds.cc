#include "semvslam/motion/depth_seeds.h"

#include <cmath>

namespace semvslam {
namespace {

constexpr std::size_t kFramesBack = 6;
constexpr int kEdgeMarginPx = 4;     // around the place in the earlier image everything must be farther
constexpr double kLeastGapM = 0.06;  // and by at least so much

}  // namespace

DepthSeeds::DepthSeeds(const Camera& camera, const MotionCheckOptions& options, int step_px)
    : camera_(camera), options_(options) {
  for (int y = step_px / 2; y < camera.height_px; y += step_px)
    for (int x = step_px / 2; x < camera.width_px; x += step_px)
      raster_.push_back({{x, y}, camera.back_project(camera.undistort(Eigen::Vector2d(x, y)), 1)});
}

bool DepthSeeds::was_empty(const Past& past, const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = past.past_from_cur * point;
  if (p.z() < 0.2) return false;
  const Eigen::Vector2d pixel = camera_.distort(camera_.project(p));
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (x < kEdgeMarginPx || y < kEdgeMarginPx || x >= past.depth.cols - kEdgeMarginPx ||
      y >= past.depth.rows - kEdgeMarginPx)
    return false;
  const float unit = static_cast<float>(1 / camera_.depth_units_per_m);
  for (const int dy : {0, -kEdgeMarginPx, kEdgeMarginPx})
    for (const int dx : {0, -kEdgeMarginPx, kEdgeMarginPx}) {
      const double z = depth_at_m(past.depth, unit, x + dx, y + dy);
      if (!(z > 0)) return false;  // nothing measured: the thing may have been there
      const double noise = options_.depth_sigma_per_m2 * std::hypot(z * z, p.z() * p.z());
      const double sigma = std::hypot(noise, options_.depth_bias_share * z);
      if (z - p.z() < std::max(kLeastGapM, options_.moving_sigmas * sigma)) return false;
    }
  return true;
}

const std::vector<DepthSeed>& DepthSeeds::step(const cv::Mat& depth, const std::optional<SE3>& cur_from_prev) {
  seeds_.clear();
  if (!cur_from_prev || depth.empty()) past_.clear();
  if (depth.empty()) return seeds_;
  if (cur_from_prev) {
    const SE3 prev_from_cur = cur_from_prev->inverse();
    for (Past& past : past_) past.past_from_cur = past.past_from_cur * prev_from_cur;
  }
  if (past_.size() > 1) {
    const Past& past = past_.front();
    const float unit = static_cast<float>(1 / camera_.depth_units_per_m);
    for (const Place& place : raster_) {
      const float z = depth_at_m(depth, unit, place.pixel.x, place.pixel.y);
      if (z > 0 && was_empty(past, place.ray * z)) seeds_.push_back({place.pixel, z});
    }
  }
  past_.push_back({depth, SE3()});
  if (past_.size() > kFramesBack) past_.pop_front();
  return seeds_;
}

}  // namespace semvslam
