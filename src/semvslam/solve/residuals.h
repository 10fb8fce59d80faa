#pragma once

#include <Eigen/Core>
#include <cmath>

#include "semvslam/geometry/se3.h"
#include "semvslam/solve/observation.h"

// The residuals of PointObservation and what every solver of this module builds from them. Written once over the scalar
// type T: double, or a pack of doubles (one lane per observation), so that the fast solvers run the code that the tests
// check.

namespace semvslam {

/// Points closer to the image plane than this (or behind it) cannot be seen: their residuals do not exist.
inline constexpr double kMinDepthM = 1e-3;
/// Cost of a measurement whose point a step pushes behind the camera: no step may gain by it.
inline constexpr double kBehindCameraCost = 1e4;

/// Residuals (measured - predicted) of one observation, px, and the entries of d(prediction)/d(point in the camera
/// frame) that are not identically zero. Needs z > 0.
template <typename T>
struct ResidualTerms {
  T u, v, disparity;
  T du_dx, du_dz, dv_dy, dv_dz, dd_dz;
};

template <typename T>
inline ResidualTerms<T> residual_terms(const Intrinsics& c, const T& x, const T& y, const T& z, const T& u, const T& v,
                                       const T& disparity) {
  const T inverse_z = 1.0 / z;
  const T a = x * inverse_z, b = y * inverse_z;
  ResidualTerms<T> r;
  r.u = u - (c.fx_px * a + c.cx_px);
  r.v = v - (c.fy_px * b + c.cy_px);
  const T predicted_disparity = c.focal_baseline_px_m * inverse_z;
  r.disparity = disparity - predicted_disparity;
  r.du_dx = c.fx_px * inverse_z;
  r.du_dz = -r.du_dx * a;
  r.dv_dy = c.fy_px * inverse_z;
  r.dv_dz = -r.dv_dy * b;
  r.dd_dz = -predicted_disparity * inverse_z;
  return r;
}

/// G^T W G and G^T W r of one observation, G = d(prediction)/d(point in the camera frame), W = the two weights. The xy
/// entry of the matrix is zero. Every normal equation of this module follows from these and the point itself.
template <typename T>
struct PointInformation {
  T xx, xz, yy, yz, zz;
  T gx, gy, gz;
};

template <typename T>
inline PointInformation<T> point_information(const ResidualTerms<T>& r, const T& pixel_weight,
                                             const T& disparity_weight) {
  const T wu = pixel_weight * r.du_dx, wv = pixel_weight * r.dv_dy;
  const T wuz = pixel_weight * r.du_dz, wvz = pixel_weight * r.dv_dz, wd = disparity_weight * r.dd_dz;
  return {wu * r.du_dx,
          wu * r.du_dz,
          wv * r.dv_dy,
          wv * r.dv_dz,
          wuz * r.du_dz + wvz * r.dv_dz + wd * r.dd_dz,
          wu * r.u,
          wv * r.v,
          wuz * r.u + wvz * r.v + wd * r.disparity};
}

/// Entries of the 6x6 normal matrix of a pose (upper triangle, row by row) and its right side, for the left increment
/// (rho, phi): the point moves by rho + phi x p, so H = [I; [p]x] M [I, -[p]x] and g = [m; p x m].
inline constexpr int kPoseEntries = 21;

template <typename T>
inline void pose_normal(const PointInformation<T>& m, const T& x, const T& y, const T& z, T* h, T* g) {
  // Rows of A = -M [p]x, the upper right block: row_i(A) = p x row_i(M).
  const T a00 = y * m.xz, a01 = z * m.xx - x * m.xz, a02 = -(y * m.xx);
  const T a10 = y * m.yz - z * m.yy, a11 = -(x * m.yz), a12 = x * m.yy;
  const T a20 = y * m.zz - z * m.yz, a21 = z * m.xz - x * m.zz, a22 = x * m.yz - y * m.xz;
  h[0] = m.xx;
  h[1] = T{};
  h[2] = m.xz;
  h[3] = a00;
  h[4] = a01;
  h[5] = a02;
  h[6] = m.yy;
  h[7] = m.yz;
  h[8] = a10;
  h[9] = a11;
  h[10] = a12;
  h[11] = m.zz;
  h[12] = a20;
  h[13] = a21;
  h[14] = a22;
  // B = [p]x A, the lower right block.
  h[15] = y * a20 - z * a10;
  h[16] = y * a21 - z * a11;
  h[17] = y * a22 - z * a12;
  h[18] = z * a01 - x * a21;
  h[19] = z * a02 - x * a22;
  h[20] = x * a12 - y * a02;
  g[0] = m.gx;
  g[1] = m.gy;
  g[2] = m.gz;
  g[3] = y * m.gz - z * m.gy;
  g[4] = z * m.gx - x * m.gz;
  g[5] = x * m.gy - y * m.gx;
}

/// Adds what pose_normal() gives.
template <typename T>
inline void add_pose_normal(const PointInformation<T>& m, const T& x, const T& y, const T& z, T* h, T* g) {
  T one_h[kPoseEntries], one_g[6];
  pose_normal(m, x, y, z, one_h, one_g);
  for (int i = 0; i < kPoseEntries; ++i)
    if (i != 1) h[i] += one_h[i];
  for (int i = 0; i < 6; ++i) g[i] += one_g[i];
}

/// The symmetric matrix whose upper triangle add_pose_normal() filled.
Eigen::Matrix<double, 6, 6> unpack_pose_normal(const double* h);

/// Huber's loss of a squared error s >= 0 (in units of its variance) with the corner at `limit` = delta^2:
/// s below the corner, 2 delta sqrt(s) - delta^2 above. Twice the usual definition, so that it equals chi^2 inside.
inline double huber_cost(double s, double limit) { return s <= limit ? s : 2 * std::sqrt(limit * s) - limit; }
/// Its derivative, the weight of iteratively re-weighted least squares: 1 below the corner, delta / sqrt(s) above.
inline double huber_weight(double s, double limit) { return s <= limit ? 1.0 : std::sqrt(limit / s); }

/// Residual (u, v, disparity), px, of a point in the camera frame and its derivatives. The disparity row is zero when
/// the observation has none. For z <= 0 everything is zero and `valid` is false.
struct DenseResidual {
  bool valid = false;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 6> by_pose = Eigen::Matrix<double, 3, 6>::Zero();  // left increment of camera_from_world
  Eigen::Matrix3d by_point = Eigen::Matrix3d::Zero();                         // point in the world
};
DenseResidual dense_residual(const Intrinsics& camera, const SE3& camera_from_world,
                             const Eigen::Vector3d& point_in_world, const PointObservation& observation);

/// Finite numbers of a size that squares do not overflow, and positive weights: what a solver may use.
bool is_usable(const PointObservation& observation);
bool is_usable(const Eigen::Vector3d& point);
/// It carries a depth that a solver may use.
bool has_depth(const PointObservation& observation);
bool is_usable(const Intrinsics& camera);

}  // namespace semvslam
