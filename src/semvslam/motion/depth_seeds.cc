#include "semvslam/motion/depth_seeds.h"

namespace semvslam {
namespace {

constexpr std::size_t kFramesBack = 6;
constexpr int kEdgeMarginPx = 4;     // around the place in the earlier image everything must be farther
constexpr double kLeastGapM = 0.06;  // and by at least so much

}  // namespace

DepthSeeds::DepthSeeds(const Camera& camera, const MotionCheckOptions& options, int step_px)
    : camera_(camera), bent_(!camera.distortion.is_zero()), options_(options) {
  for (int y = step_px / 2; y < camera.height_px; y += step_px)
    for (int x = step_px / 2; x < camera.width_px; x += step_px)
      raster_.push_back({{x, y}, camera.back_project(camera.undistort(Eigen::Vector2d(x, y)), 1)});
}

bool DepthSeeds::was_empty(const cv::Mat& past_depth, const Eigen::Vector3d& p) const {
  if (p.z() < 0.2) return false;
  Eigen::Vector2d pixel = camera_.project(p);
  if (bent_) pixel = camera_.distort(pixel);
  const double right = past_depth.cols - kEdgeMarginPx - 0.5, bottom = past_depth.rows - kEdgeMarginPx - 0.5;
  if (!(pixel.x() >= kEdgeMarginPx && pixel.y() >= kEdgeMarginPx && pixel.x() < right && pixel.y() < bottom))
    return false;
  const int x = static_cast<int>(pixel.x() + 0.5), y = static_cast<int>(pixel.y() + 0.5);
  const float unit = static_cast<float>(1 / camera_.depth_units_per_m);
  const double squared_sigmas = options_.moving_sigmas * options_.moving_sigmas;
  const auto is_farther = [&](int dx, int dy) {
    const double z = depth_at_m(past_depth, unit, x + dx, y + dy);
    const double gap = z - p.z();
    // Nothing measured: the thing may have been there.
    if (!(z > 0) || gap < kLeastGapM) return false;
    const double here = options_.depth_sigma_per_m2 * p.z() * p.z(), there = options_.depth_sigma_per_m2 * z * z;
    const double bias = options_.depth_bias_share * z;
    return gap * gap >= squared_sigmas * (here * here + there * there + bias * bias);
  };
  for (const int dy : {0, -kEdgeMarginPx, kEdgeMarginPx})
    for (const int dx : {0, -kEdgeMarginPx, kEdgeMarginPx})
      if (!is_farther(dx, dy)) return false;
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
    const Eigen::Matrix3d rotation = past.past_from_cur.rotation_matrix();
    const Eigen::Vector3d translation = past.past_from_cur.translation();
    for (const Place& place : raster_) {
      const float z = depth_at_m(depth, unit, place.pixel.x, place.pixel.y);
      if (z > 0 && was_empty(past.depth, z * (rotation * place.ray) + translation)) seeds_.push_back({place.pixel, z});
    }
  }
  past_.push_back({depth, SE3()});
  if (past_.size() > kFramesBack) past_.pop_front();
  return seeds_;
}

}  // namespace semvslam
