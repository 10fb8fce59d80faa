#include "semvslam/geometry/camera.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace semvslam {
namespace {

constexpr double kUndistortedSquared = 1e-20;  // of the error on the plane z = 1: below 1e-7 px

Eigen::Vector2d apply(const BrownDistortion& d, const Eigen::Vector2d& n) {
  const double x = n.x(), y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  return {x * radial + 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x),
          y * radial + d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y};
}

// d(apply)/d(n); symmetric off the diagonal.
Eigen::Matrix2d derivative(const BrownDistortion& d, const Eigen::Vector2d& n) {
  const double x = n.x(), y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  const double by_r2 = d.k1 + r2 * (2 * d.k2 + r2 * 3 * d.k3);
  const double mixed = 2 * x * y * by_r2 + 2 * d.p1 * x + 2 * d.p2 * y;
  Eigen::Matrix2d j;
  j << radial + 2 * x * x * by_r2 + 2 * d.p1 * y + 6 * d.p2 * x, mixed, mixed,
      radial + 2 * y * y * by_r2 + 6 * d.p1 * y + 2 * d.p2 * x;
  return j;
}

}  // namespace

Eigen::Vector2d Camera::distort(const Eigen::Vector2d& ideal) const {
  if (distortion.is_zero()) return ideal;
  const Eigen::Vector2d d = apply(distortion, {(ideal.x() - cx_px) / fx_px, (ideal.y() - cy_px) / fy_px});
  return {fx_px * d.x() + cx_px, fy_px * d.y() + cy_px};
}

Eigen::Vector2d Camera::undistort(const Eigen::Vector2d& recorded) const {
  if (distortion.is_zero()) return recorded;
  const Eigen::Vector2d target((recorded.x() - cx_px) / fx_px, (recorded.y() - cy_px) / fy_px);
  Eigen::Vector2d n = target, error = target - apply(distortion, n);
  for (int i = 0; i < 20 && error.squaredNorm() > kUndistortedSquared; ++i) {
    Eigen::Vector2d step = derivative(distortion, n).inverse() * error;
    Eigen::Vector2d next_error = target - apply(distortion, n + step);
    while (!(next_error.squaredNorm() < error.squaredNorm()) && step.squaredNorm() > kUndistortedSquared) {
      step *= 0.5;
      next_error = target - apply(distortion, n + step);
    }
    if (!(next_error.squaredNorm() < error.squaredNorm())) break;
    n += step;
    error = next_error;
  }
  return {fx_px * n.x() + cx_px, fy_px * n.y() + cy_px};
}

double Camera::largest_shift_px(const Camera& other) const {
  constexpr int kSteps = 8;
  double largest = 0;
  for (int row = 0; row <= kSteps; ++row)
    for (int column = 0; column <= kSteps; ++column) {
      const Eigen::Vector2d pixel(column * (width_px - 1.0) / kSteps, row * (height_px - 1.0) / kSteps);
      const Eigen::Vector3d ray = back_project(undistort(pixel), 1);
      const double shift = (other.distort(other.project(ray)) - pixel).norm();
      if (!std::isfinite(shift)) return std::numeric_limits<double>::infinity();
      largest = std::max(largest, shift);
    }
  return largest;
}

Status Camera::check() const {
  const auto bad = [](const std::string& what) { return Error{ErrorCode::kInvalidInput, "camera: " + what}; };
  if (width_px < 16 || height_px < 16 || width_px > 16384 || height_px > 16384)
    return bad(fmt::format("image size {}x{} is outside 16..16384", width_px, height_px));
  if (!(std::isfinite(fx_px) && std::isfinite(fy_px) && fx_px > 0 && fy_px > 0))
    return bad(fmt::format("focal lengths must be positive, got fx = {}, fy = {}", fx_px, fy_px));
  if (!(cx_px >= 0 && cy_px >= 0 && cx_px < width_px && cy_px < height_px))
    return bad(fmt::format("principal point ({}, {}) lies outside the {}x{} image", cx_px, cy_px, width_px, height_px));
  if (!(std::isfinite(depth_units_per_m) && depth_units_per_m > 0))
    return bad(fmt::format("depth_units_per_m must be positive, got {}", depth_units_per_m));
  if (!(std::isfinite(baseline_m) && baseline_m > 0))
    return bad(fmt::format("baseline_m must be positive, got {}", baseline_m));
  if (!(std::isfinite(frame_rate_hz) && frame_rate_hz > 0))
    return bad(fmt::format("frame_rate_hz must be positive, got {}", frame_rate_hz));
  const BrownDistortion& d = distortion;
  for (double k : {d.k1, d.k2, d.p1, d.p2, d.k3})
    if (!std::isfinite(k)) return bad("distortion coefficients must be finite numbers");
  return Status::success();
}

}  // namespace semvslam
