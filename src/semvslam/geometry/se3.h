#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semvslam {

/// Cross-product matrix: skew(a) * b == a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// A rigid motion, named `a_from_b` wherever it is stored: x_a = a_from_b * x_b. Unit quaternion and translation in
/// metres.
class SE3 {
 public:
  using Tangent = Eigen::Matrix<double, 6, 1>;  // (translation part, rotation part), left increment: exp(xi) * pose

  SE3() : rotation_(Eigen::Quaterniond::Identity()), translation_(Eigen::Vector3d::Zero()) {}
  /// @param rotation is normalised here; it must not be zero.
  SE3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  SE3(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : SE3(Eigen::Quaterniond(rotation), translation) {}
  /// Taken as it is, bit by bit: what another SE3 held before. @param rotation of unit length.
  static SE3 from_unit(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
    SE3 out;
    out.rotation_ = rotation;
    out.translation_ = translation;
    return out;
  }

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d rotation_matrix() const { return rotation_.toRotationMatrix(); }

  SE3 inverse() const {
    const Eigen::Quaterniond r = rotation_.conjugate();
    return {r, -(r * translation_)};
  }
  SE3 operator*(const SE3& other) const {
    return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation_ * point + translation_; }

  /// Exponential map of se(3), xi = (rho, phi): Barfoot, State Estimation for Robotics, section 7.1.
  static SE3 exp(const Tangent& xi);
  /// Inverse of exp for rotation angles below pi.
  Tangent log() const;
  /// Angle of the rotation in [0, pi] radians.
  double rotation_angle_rad() const;
  bool is_finite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

 private:
  Eigen::Quaterniond rotation_;
  Eigen::Vector3d translation_;
};

/// A rigid motion with scale: x_a = s R x_b + t.
struct Sim3 {
  double scale = 1.0;
  SE3 rigid;  // the rotation and the translation
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
    return scale * (rigid.rotation() * p) + rigid.translation();
  }
};

}  // namespace semvslam
