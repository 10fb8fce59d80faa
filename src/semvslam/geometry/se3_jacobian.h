#pragma once

#include <Eigen/Core>

#include "semvslam/geometry/se3.h"

namespace semvslam {

/// Ad with pose * exp(xi) * pose^-1 = exp(Ad xi), for tangents (rho, phi). Barfoot, section 7.1.4.
Eigen::Matrix<double, 6, 6> adjoint(const SE3& pose);

/// J with exp(J dxi + O(dxi^2)) * exp(xi) = exp(xi + dxi). Barfoot, section 7.1.5 (eq. for Q).
Eigen::Matrix<double, 6, 6> left_jacobian(const SE3::Tangent& xi);
/// Its inverse: log(exp(d) * exp(xi)) = xi + J^-1 d + O(d^2). Rotation angle below 2 pi.
Eigen::Matrix<double, 6, 6> left_jacobian_inverse(const SE3::Tangent& xi);
/// log(exp(xi) * exp(d)) = xi + J^-1 d + O(d^2).
Eigen::Matrix<double, 6, 6> right_jacobian_inverse(const SE3::Tangent& xi);

}  // namespace semvslam
