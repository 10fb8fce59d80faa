#include "semvslam/geometry/se3_jacobian.h"

#include <Eigen/LU>
#include <cmath>

namespace semvslam {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kSeriesBelowRad = 0.05;  // the closed forms lose digits to cancellation below

struct Blocks {
  Eigen::Matrix3d rotation;  // left Jacobian of SO(3)
  Eigen::Matrix3d mixed;     // Barfoot's Q
};

Blocks blocks(const SE3::Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  const Eigen::Matrix3d r = skew(xi.head<3>()), p = skew(phi);
  const double t2 = phi.squaredNorm(), t = std::sqrt(t2);
  double a = 0.5 - t2 / 24 + t2 * t2 / 720;          // (1 - cos t) / t^2
  double b = 1.0 / 6 - t2 / 120 + t2 * t2 / 5040;    // (t - sin t) / t^3
  double c = 1.0 / 24 - t2 / 720 + t2 * t2 / 40320;  // (t^2 / 2 + cos t - 1) / t^4
  double d = 1.0 / 120 - t2 / 2520;                  // (2 t - 3 sin t + t cos t) / (2 t^5)
  if (t > kSeriesBelowRad) {
    const double s = std::sin(t), k = std::cos(t);
    a = (1 - k) / t2;
    b = (t - s) / (t2 * t);
    c = (0.5 * t2 + k - 1) / (t2 * t2);
    d = (2 * t - 3 * s + t * k) / (2 * t2 * t2 * t);
  }
  const Eigen::Matrix3d prp = p * r * p;
  return {Eigen::Matrix3d::Identity() + a * p + b * p * p,
          0.5 * r + b * (p * r + r * p + prp) + c * (p * p * r + r * p * p - 3 * prp) + d * (prp * p + p * prp)};
}

}  // namespace

Matrix6 adjoint(const SE3& pose) {
  const Eigen::Matrix3d r = pose.rotation_matrix();
  Matrix6 m;
  m << r, skew(pose.translation()) * r, Eigen::Matrix3d::Zero(), r;
  return m;
}

Matrix6 left_jacobian(const SE3::Tangent& xi) {
  const Blocks b = blocks(xi);
  Matrix6 m;
  m << b.rotation, b.mixed, Eigen::Matrix3d::Zero(), b.rotation;
  return m;
}

Matrix6 left_jacobian_inverse(const SE3::Tangent& xi) {
  const Blocks b = blocks(xi);
  const Eigen::Matrix3d inverse = b.rotation.inverse();
  Matrix6 m;
  m << inverse, -inverse * b.mixed * inverse, Eigen::Matrix3d::Zero(), inverse;
  return m;
}

Matrix6 right_jacobian_inverse(const SE3::Tangent& xi) { return left_jacobian_inverse(-xi); }

}  // namespace semvslam
