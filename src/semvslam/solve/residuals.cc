#include "semvslam/solve/residuals.h"

#include <cmath>

namespace semvslam {
namespace {

constexpr double kLargest = 1e9;

}  // namespace

Eigen::Matrix<double, 6, 6> unpack_pose_normal(const double* h) {
  Eigen::Matrix<double, 6, 6> m;
  int k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) m(r, c) = m(c, r) = h[k++];
  return m;
}

DenseResidual dense_residual(const Intrinsics& camera, const SE3& camera_from_world,
                             const Eigen::Vector3d& point_in_world, const PointObservation& observation) {
  DenseResidual out;
  const Eigen::Vector3d p = camera_from_world * point_in_world;
  if (!(p.z() > kMinDepthM)) return out;
  const ResidualTerms<double> r = residual_terms(camera, p.x(), p.y(), p.z(), observation.pixel.x(),
                                                 observation.pixel.y(), observation.disparity_px);
  Eigen::Matrix3d g;  // d(prediction)/d(p)
  g << r.du_dx, 0, r.du_dz, 0, r.dv_dy, r.dv_dz, 0, 0, r.dd_dz;
  out.value = {r.u, r.v, r.disparity};
  if (!has_depth(observation)) {
    out.value.z() = 0;
    g.row(2).setZero();
  }
  out.by_pose.leftCols<3>() = -g;
  out.by_pose.rightCols<3>() = g * skew(p);
  out.by_point = -g * camera_from_world.rotation_matrix();
  out.valid = true;
  return out;
}

bool is_usable(const PointObservation& o) {
  return o.pixel.allFinite() && o.pixel.cwiseAbs().maxCoeff() <= kLargest && o.inverse_variance_px > 0 &&
         o.inverse_variance_px <= kLargest;
}

bool is_usable(const Eigen::Vector3d& point) { return point.allFinite() && point.cwiseAbs().maxCoeff() <= kLargest; }

bool has_depth(const PointObservation& o) {
  return o.disparity_px > 0 && o.disparity_px <= kLargest && o.inverse_variance_disparity > 0 &&
         o.inverse_variance_disparity <= kLargest;
}

bool is_usable(const Intrinsics& c) {
  return std::isfinite(c.fx_px) && std::isfinite(c.fy_px) && std::isfinite(c.cx_px) && std::isfinite(c.cy_px) &&
         std::isfinite(c.focal_baseline_px_m) && c.fx_px > 0 && c.fy_px > 0 && c.focal_baseline_px_m >= 0;
}

}  // namespace semvslam
