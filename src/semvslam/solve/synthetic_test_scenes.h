#pragma once

#include <limits>
#include <random>
#include <vector>

#include "semvslam/solve/bundle_adjustment.h"

// Made-up scenes with known truth, for the tests and benchmarks of this module only.

namespace semvslam::synthetic {

inline Camera vga_camera() {
  Camera c;
  c.width_px = 640;
  c.height_px = 480;
  c.fx_px = 525;
  c.fy_px = 520;
  c.cx_px = 319.5;
  c.cy_px = 241;
  return c;
}

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline const Intrinsics kVga = Intrinsics::of(vga_camera());

/// Length of the twist between two poses.
inline double pose_error(const SE3& a, const SE3& b) { return (a * b.inverse()).log().norm(); }

struct BundleOptions {
  int poses = 24;
  int fixed = 12;  // the first ones
  int points = 2000;
  int edges_per_point = 6;  // at most: a point outside an image has no edge there
  double pixel_noise_px = 0.5;
  double disparity_noise_px = 0.5;
  double depth_share = 0.8;        // of the observations that have a depth
  double outlier_share = 0;        // of the pixels: moved by 20..100 px
  double depth_outlier_share = 0;  // of the depths: disparity moved by 10..30 px
  double pose_error = 0.02;        // m and rad, of the start
  double point_error_m = 0.05;
  int neighbours = 0;  // > 0: a point is seen by so many consecutive poses at most, not by poses all over
  std::uint32_t seed = 1;
};

struct Bundle {
  BaProblem problem;  // at the start
  std::vector<SE3> true_poses;
  std::vector<Eigen::Vector3d> true_points;
  std::vector<std::uint8_t> is_outlier, is_depth_outlier;  // per edge
};

/// Cameras on an arc that look at a cloud of points 1.5 to 5 m away.
inline Bundle make_bundle(const BundleOptions& o) {
  std::mt19937 rng(o.seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> normal(0, 1);
  const auto random3 = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
  const Camera camera = vga_camera();
  Bundle out;
  BaProblem& p = out.problem;
  p.camera = Intrinsics::of(camera);
  for (int i = 0; i < o.poses; ++i) {
    const double a = 0.6 * (i - 0.5 * o.poses) / o.poses;
    SE3::Tangent wobble;
    wobble.head<3>() = 0.05 * random3();
    wobble.tail<3>() = 0.03 * random3();
    const SE3 world_from_camera(Eigen::Quaterniond(Eigen::AngleAxisd(-a, Eigen::Vector3d::UnitY())),
                                Eigen::Vector3d(2 * std::sin(a), 0.1 * unit(rng), 0.5 * (1 - std::cos(a))));
    out.true_poses.push_back(SE3::exp(wobble) * world_from_camera.inverse());
    p.pose_fixed.push_back(i < o.fixed);
    SE3::Tangent error;
    error.head<3>() = o.pose_error * random3();
    error.tail<3>() = o.pose_error * random3();
    p.poses.push_back(i < o.fixed ? out.true_poses.back() : SE3::exp(error) * out.true_poses.back());
  }
  for (int k = 0; k < o.points; ++k) {
    const double z = 3.25 + 1.75 * unit(rng);
    out.true_points.emplace_back(0.5 * z * unit(rng), 0.4 * z * unit(rng), z);
    p.points.push_back(out.true_points.back() + o.point_error_m * random3());
    const int first = static_cast<int>(rng() % static_cast<std::uint32_t>(o.poses));
    for (int s = 0; s < o.edges_per_point && s < o.poses; ++s) {
      const int stride = o.neighbours > 0 ? 1 : std::max(1, o.poses / o.edges_per_point);
      const int i = (first + s * stride) % o.poses;
      if (o.neighbours > 0 && (s >= o.neighbours || first + s >= o.poses)) break;
      const Eigen::Vector3d c = out.true_poses[static_cast<std::size_t>(i)] * out.true_points.back();
      const Eigen::Vector2d pixel = camera.project(c);
      if (c.z() < 0.3 || pixel.x() < 0 || pixel.y() < 0 || pixel.x() > 639 || pixel.y() > 479) continue;
      BaProblem::Edge e;
      e.pose = static_cast<std::uint32_t>(i);
      e.point = static_cast<std::uint32_t>(k);
      e.observation.pixel = pixel + o.pixel_noise_px * Eigen::Vector2d(normal(rng), normal(rng));
      const double sigma_px = std::max(o.pixel_noise_px, 0.1), sigma_d = std::max(o.disparity_noise_px, 0.1);
      e.observation.inverse_variance_px = 1 / (sigma_px * sigma_px);
      e.observation.inverse_variance_disparity = 1 / (sigma_d * sigma_d);
      const bool with_depth = 0.5 * (1 + unit(rng)) < o.depth_share;
      const bool outlier = 0.5 * (1 + unit(rng)) < o.outlier_share;
      const bool depth_outlier = with_depth && 0.5 * (1 + unit(rng)) < o.depth_outlier_share;
      if (with_depth)
        e.observation.disparity_px = p.camera.focal_baseline_px_m / c.z() + o.disparity_noise_px * normal(rng);
      if (outlier) {
        const double angle = 3.14159 * unit(rng);
        e.observation.pixel += (60 + 40 * unit(rng)) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      }
      if (depth_outlier) e.observation.disparity_px += 20 + 10 * unit(rng);
      p.edges.push_back(e);
      out.is_outlier.push_back(outlier);
      out.is_depth_outlier.push_back(depth_outlier);
    }
  }
  return out;
}

/// What one camera of a bundle sees, for pose-only problems.
struct View {
  SE3 truth;
  std::vector<Eigen::Vector3d> points;
  std::vector<PointObservation> observations;
  std::vector<std::uint8_t> is_outlier, is_depth_outlier;
};

inline View make_view(BundleOptions o) {
  o.poses = 1;
  o.edges_per_point = 1;
  const Bundle b = make_bundle(o);
  View v;
  v.truth = b.true_poses[0];
  for (std::size_t i = 0; i < b.problem.edges.size(); ++i) {
    v.points.push_back(b.true_points[b.problem.edges[i].point]);
    v.observations.push_back(b.problem.edges[i].observation);
  }
  v.is_outlier = b.is_outlier;
  v.is_depth_outlier = b.is_depth_outlier;
  return v;
}

}  // namespace semvslam::synthetic
