#include "semvslam/geometry/se3.h"

#include <cmath>

namespace semvslam {
namespace {

// Left Jacobian of SO(3): I + (1-cos t)/t^2 [phi] + (t-sin t)/t^3 [phi]^2, with series near t = 0.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) {
  const double t2 = phi.squaredNorm();
  const Eigen::Matrix3d k = skew(phi);
  double a = 0.5 - t2 / 24.0;
  double b = 1.0 / 6.0 - t2 / 120.0;
  if (t2 > 1e-8) {
    const double t = std::sqrt(t2);
    a = (1.0 - std::cos(t)) / t2;
    b = (t - std::sin(t)) / (t2 * t);
  }
  return Eigen::Matrix3d::Identity() + a * k + b * k * k;
}

Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& phi) {
  const double t2 = phi.squaredNorm();
  double w = 1.0 - t2 / 8.0;
  double k = 0.5 - t2 / 48.0;
  if (t2 > 1e-8) {
    const double t = std::sqrt(t2);
    w = std::cos(0.5 * t);
    k = std::sin(0.5 * t) / t;
  }
  return Eigen::Quaterniond(w, k * phi.x(), k * phi.y(), k * phi.z()).normalized();
}

Eigen::Vector3d log_rotation(const Eigen::Quaterniond& q_in) {
  const Eigen::Quaterniond q = q_in.w() < 0 ? Eigen::Quaterniond(-q_in.coeffs()) : q_in;
  const double n = q.vec().norm();
  if (n < 1e-10) return 2.0 / q.w() * q.vec();
  return 2.0 * std::atan2(n, q.w()) / n * q.vec();
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

SE3 SE3::exp(const Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  return {exp_rotation(phi), left_jacobian(phi) * xi.head<3>()};
}

SE3::Tangent SE3::log() const {
  Tangent xi;
  const Eigen::Vector3d phi = log_rotation(rotation_);
  xi.tail<3>() = phi;
  xi.head<3>() = left_jacobian(phi).partialPivLu().solve(translation_);
  return xi;
}

double SE3::rotation_angle_rad() const { return 2.0 * std::atan2(rotation_.vec().norm(), std::abs(rotation_.w())); }

}  // namespace semvslam
