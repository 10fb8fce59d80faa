#include "semvslam/solve/pnp.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "semvslam/solve/residuals.h"

namespace semvslam {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;

// Real roots of c[0] + c[1] x + ... + c[4] x^4: eigenvalues of the companion matrix. Pairs with a small imaginary part
// are taken as a double root that rounding has split; the polishing that follows decides.
std::vector<double> real_roots(const Vector5& c) {
  std::vector<double> roots;
  const double largest = c.cwiseAbs().maxCoeff();
  if (!(largest > 0) || !std::isfinite(largest) || std::abs(c[4]) < 1e-14 * largest) return roots;
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.diagonal(-1).setOnes();
  companion.col(3) = -c.head<4>() / c[4];
  const Eigen::EigenSolver<Eigen::Matrix4d> solver(companion, false);
  if (solver.info() != Eigen::Success) return roots;
  for (int i = 0; i < 4; ++i) {
    const std::complex<double> r = solver.eigenvalues()[i];
    if (std::abs(r.imag()) < 1e-4 * (1 + std::abs(r.real()))) roots.push_back(r.real());
  }
  return roots;
}

// Distances s along the directions: s_i^2 + s_j^2 - 2 s_i s_j cos_ij = d_ij^2 for the pairs (0,1), (0,2), (1,2).
struct DistanceSystem {
  double cos01, cos02, cos12;
  double d01, d02, d12;  // squared

  Eigen::Vector3d residual(const Eigen::Vector3d& s) const {
    return {s[0] * s[0] + s[1] * s[1] - 2 * s[0] * s[1] * cos01 - d01,
            s[0] * s[0] + s[2] * s[2] - 2 * s[0] * s[2] * cos02 - d02,
            s[1] * s[1] + s[2] * s[2] - 2 * s[1] * s[2] * cos12 - d12};
  }
  // Newton's method. @return false when this is no solution.
  bool polish(Eigen::Vector3d& s) const {
    for (int i = 0; i < 6; ++i) {
      Eigen::Matrix3d j;
      j << 2 * (s[0] - s[1] * cos01), 2 * (s[1] - s[0] * cos01), 0, 2 * (s[0] - s[2] * cos02), 0,
          2 * (s[2] - s[0] * cos02), 0, 2 * (s[1] - s[2] * cos12), 2 * (s[2] - s[1] * cos12);
      const Eigen::Vector3d step = j.partialPivLu().solve(residual(s));
      if (!step.allFinite()) break;
      s -= step;
      if (step.squaredNorm() < 1e-28 * s.squaredNorm()) break;
    }
    return s.allFinite() && s.minCoeff() > 0 && residual(s).norm() < 1e-8 * (d01 + d02 + d12);
  }
};

// With u = s1 / s0 and v = s2 / s0 the three equations leave two conics with equal u^2 terms; their difference is
// linear in u, u = N(v) / D(v), and putting it back gives a quartic in v.
std::vector<Eigen::Vector3d> solve_distances(const DistanceSystem& e) {
  const double a = e.d01, b = e.d02, c = e.d12;
  const Eigen::Vector3d q(1, -2 * e.cos02, 1);                            // 1 - 2 v cos02 + v^2
  const Eigen::Vector3d n = (a - c) * q - b * Eigen::Vector3d(1, 0, -1);  // N(v)
  const Eigen::Vector2d d(-2 * b * e.cos01, 2 * b * e.cos12);             // D(v)
  const Eigen::Vector3d dd(d[0] * d[0], 2 * d[0] * d[1], d[1] * d[1]);
  Vector5 quartic = Vector5::Zero();
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) quartic[i + k] += b * n[i] * n[k] - a * q[i] * dd[k];
    for (int k = 0; k < 2; ++k) quartic[i + k] -= 2 * b * e.cos01 * n[i] * d[k];
    quartic[i] += b * dd[i];
  }
  std::vector<Eigen::Vector3d> out;
  for (const double v : real_roots(quartic)) {
    const double qv = q[0] + v * (q[1] + v * q[2]), dv = d[0] + v * d[1];
    if (!(qv > 0) || !(v > 0)) continue;
    const double s0 = std::sqrt(b / qv);
    std::array<double, 2> us{(n[0] + v * (n[1] + v * n[2])) / dv, 0};
    std::size_t count = 1;
    if (std::abs(dv) < 1e-6 * b) {  // both solutions of the first conic instead
      const double discriminant = e.cos01 * e.cos01 - 1 + a * qv / b;
      if (discriminant < 0) continue;
      us = {e.cos01 - std::sqrt(discriminant), e.cos01 + std::sqrt(discriminant)};
      count = 2;
    }
    for (std::size_t k = 0; k < count; ++k) {
      Eigen::Vector3d s(s0, us[k] * s0, v * s0);
      if (us[k] > 0 && e.polish(s)) out.push_back(s);
    }
  }
  return out;
}

// Orthonormal axes of a triangle: columns along the first side, in the plane, normal.
Eigen::Matrix3d triangle_axes(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1, const Eigen::Vector3d& p2) {
  Eigen::Matrix3d m;
  m.col(0) = (p1 - p0).normalized();
  m.col(2) = m.col(0).cross(p2 - p0).normalized();
  m.col(1) = m.col(2).cross(m.col(0));
  return m;
}

struct AbsolutePoseProblem {
  using Model = SE3;
  static constexpr int kSampleSize = 3;
  Intrinsics camera;
  std::vector<Eigen::Vector3d> points, directions;
  std::vector<PointObservation> observations;

  std::size_t size() const { return points.size(); }
  void hypotheses(const std::array<std::size_t, 3>& s, std::vector<SE3>& out) const {
    solve_p3p({directions[s[0]], directions[s[1]], directions[s[2]]}, {points[s[0]], points[s[1]], points[s[2]]}, out);
  }
  double squared_residual(const SE3& camera_from_world, std::size_t i) const {
    const Eigen::Vector3d p = camera_from_world * points[i];
    if (!(p.z() > kMinDepthM)) return std::numeric_limits<double>::infinity();
    const Eigen::Vector2d& pixel = observations[i].pixel;
    const double u = pixel.x() - (camera.fx_px * p.x() / p.z() + camera.cx_px);
    const double v = pixel.y() - (camera.fy_px * p.y() / p.z() + camera.cy_px);
    return observations[i].inverse_variance_px * (u * u + v * v);
  }
};

}  // namespace

void solve_p3p(const std::array<Eigen::Vector3d, 3>& f, const std::array<Eigen::Vector3d, 3>& x,
               std::vector<SE3>& camera_from_world) {
  const DistanceSystem system{f[0].dot(f[1]),
                              f[0].dot(f[2]),
                              f[1].dot(f[2]),
                              (x[0] - x[1]).squaredNorm(),
                              (x[0] - x[2]).squaredNorm(),
                              (x[1] - x[2]).squaredNorm()};
  const double area = (x[1] - x[0]).cross(x[2] - x[0]).norm();
  const double longest = std::max({system.d01, system.d02, system.d12});
  if (!(area > 1e-6 * longest)) return;  // on a line, in one place or NaN
  const Eigen::Matrix3d world_axes = triangle_axes(x[0], x[1], x[2]);
  for (const Eigen::Vector3d& s : solve_distances(system)) {
    const Eigen::Vector3d p0 = s[0] * f[0];
    const Eigen::Matrix3d rotation = triangle_axes(p0, s[1] * f[1], s[2] * f[2]) * world_axes.transpose();
    const SE3 pose(rotation, p0 - rotation * x[0]);
    if (pose.is_finite()) camera_from_world.push_back(pose);
  }
}

Result<PnpEstimate> estimate_pose(const Intrinsics& camera, std::span<const Eigen::Vector3d> points_in_world,
                                  std::span<const PointObservation> observations, const PnpOptions& options) {
  if (points_in_world.size() != observations.size())
    throw std::invalid_argument("estimate_pose: points and observations differ in number");
  AbsolutePoseProblem problem{camera, {}, {}, {}};
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!is_usable(points_in_world[i]) || !is_usable(observations[i])) continue;
    const Eigen::Vector2d& pixel = observations[i].pixel;
    problem.points.push_back(points_in_world[i]);
    problem.observations.push_back(observations[i]);
    problem.directions.push_back(
        Eigen::Vector3d((pixel.x() - camera.cx_px) / camera.fx_px, (pixel.y() - camera.cy_px) / camera.fy_px, 1)
            .normalized());
  }
  const auto refuse = [](std::string why) {
    return Error{ErrorCode::kInvalidInput, "pose from matches: " + std::move(why)};
  };
  if (!is_usable(camera)) return refuse("the camera's focal lengths are not positive numbers");
  if (problem.size() < 4) return refuse(fmt::format("at least 4 usable matches are needed, got {}", problem.size()));
  const RansacResult<SE3> best = ransac(problem, options.chi2_pixel, options.ransac);
  PnpEstimate out;
  out.iterations = best.iterations;
  if (best.found)
    out.pose = optimize_pose(camera, best.model, points_in_world, observations, options.refinement, out.inlier);
  if (out.pose.inliers < options.min_inliers)
    return refuse(fmt::format("only {} of {} matches agree on a pose, {} are needed", out.pose.inliers, problem.size(),
                              options.min_inliers));
  return out;
}

}  // namespace semvslam
