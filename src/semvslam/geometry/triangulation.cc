#include "semvslam/geometry/triangulation.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace semvslam {
namespace {

constexpr int kIterations = 5;

double angle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

// Everything is done in the frame of camera a.
class TwoViews {
 public:
  TwoViews(const Camera& a, const Camera& b, const SE3& b_from_a, const Eigen::Vector2d& pixel_a,
           const Eigen::Vector2d& pixel_b, double weight_b)
      : camera_a_(a),
        camera_b_(b),
        rotation_(b_from_a.rotation_matrix()),
        translation_(b_from_a.translation()),
        pixel_a_(pixel_a),
        pixel_b_(pixel_b),
        weight_b_(weight_b) {}

  Eigen::Vector3d ray_a() const { return camera_a_.back_project(pixel_a_, 1.0); }
  Eigen::Vector3d ray_b() const { return rotation_.transpose() * camera_b_.back_project(pixel_b_, 1.0); }
  Eigen::Vector3d in_b(const Eigen::Vector3d& p) const { return rotation_ * p + translation_; }
  Eigen::Vector2d residual_a(const Eigen::Vector3d& p) const { return pixel_a_ - camera_a_.project(p); }
  Eigen::Vector2d residual_b(const Eigen::Vector3d& p) const { return pixel_b_ - camera_b_.project(in_b(p)); }

  // Depths s, t along the rays that bring them nearest: s ra - t rb = centre of b.
  Eigen::Vector3d midpoint() const {
    const Eigen::Vector3d ra = ray_a(), rb = ray_b(), c = -(rotation_.transpose() * translation_);
    Eigen::Matrix2d m;
    m << ra.squaredNorm(), -ra.dot(rb), -ra.dot(rb), rb.squaredNorm();
    const Eigen::Vector2d st = m.inverse() * Eigen::Vector2d(ra.dot(c), -rb.dot(c));
    return 0.5 * (st[0] * ra + c + st[1] * rb);
  }

  bool in_front(const Eigen::Vector3d& p) const { return p.z() > 0 && in_b(p).z() > 0; }

  Eigen::Vector3d refine(Eigen::Vector3d p) const {
    double cost = cost_at(p);
    for (int i = 0; i < kIterations; ++i) {
      const Eigen::Matrix<double, 2, 3> ja = projection_jacobian(camera_a_, p);
      const Eigen::Matrix<double, 2, 3> jb = projection_jacobian(camera_b_, in_b(p)) * rotation_;
      const Eigen::Matrix3d h = ja.transpose() * ja + weight_b_ * jb.transpose() * jb;
      const Eigen::Vector3d g = ja.transpose() * residual_a(p) + weight_b_ * jb.transpose() * residual_b(p);
      const Eigen::Vector3d moved = p + h.ldlt().solve(g);
      if (!moved.allFinite() || !in_front(moved)) break;
      const double moved_cost = cost_at(moved);
      if (!(moved_cost < cost)) break;
      const bool converged = cost - moved_cost < 1e-9 * cost;
      p = moved;
      cost = moved_cost;
      if (converged) break;
    }
    return p;
  }

 private:
  static Eigen::Matrix<double, 2, 3> projection_jacobian(const Camera& c, const Eigen::Vector3d& p) {
    const double iz = 1 / p.z();
    Eigen::Matrix<double, 2, 3> j;
    j << c.fx_px * iz, 0, -c.fx_px * p.x() * iz * iz, 0, c.fy_px * iz, -c.fy_px * p.y() * iz * iz;
    return j;
  }
  double cost_at(const Eigen::Vector3d& p) const {
    return residual_a(p).squaredNorm() + weight_b_ * residual_b(p).squaredNorm();
  }

  const Camera& camera_a_;
  const Camera& camera_b_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  Eigen::Vector2d pixel_a_, pixel_b_;
  double weight_b_;
};

}  // namespace

double parallax_rad(const Eigen::Vector3d& point, const Eigen::Vector3d& centre_a, const Eigen::Vector3d& centre_b) {
  return angle_rad(point - centre_a, point - centre_b);
}

Triangulation triangulate(const Camera& camera_a, const SE3& a_from_world, const Eigen::Vector2d& pixel_a,
                          const Camera& camera_b, const SE3& b_from_world, const Eigen::Vector2d& pixel_b,
                          const TriangulationLimits& limits, double sigma_ratio_b) {
  Triangulation out;
  if (!pixel_a.allFinite() || !pixel_b.allFinite() || !a_from_world.is_finite() || !b_from_world.is_finite())
    return out;
  const SE3 world_from_a = a_from_world.inverse();
  const TwoViews views(camera_a, camera_b, b_from_world * world_from_a, pixel_a, pixel_b,
                       1 / (sigma_ratio_b * sigma_ratio_b));
  out.parallax_rad = angle_rad(views.ray_a(), views.ray_b());
  out.verdict = TriangulationVerdict::kLowParallax;
  if (!(out.parallax_rad >= limits.min_parallax_rad) || !(out.parallax_rad > 1e-9)) return out;

  Eigen::Vector3d p = views.midpoint();
  out.verdict = TriangulationVerdict::kBehind;
  if (!p.allFinite() || !views.in_front(p)) return out;
  p = views.refine(p);
  const double depth_a = p.z(), depth_b = views.in_b(p).z();
  if (!(std::min(depth_a, depth_b) >= limits.min_depth_m && std::max(depth_a, depth_b) <= limits.max_depth_m))
    return out;

  out.point_in_world = world_from_a * p;
  out.error_a_px = views.residual_a(p).norm();
  out.error_b_px = views.residual_b(p).norm();
  const bool close = out.error_a_px <= limits.max_error_px && out.error_b_px <= limits.max_error_px * sigma_ratio_b;
  out.verdict = close ? TriangulationVerdict::kGood : TriangulationVerdict::kReprojection;
  return out;
}

}  // namespace semvslam
