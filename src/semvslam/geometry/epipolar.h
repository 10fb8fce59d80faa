#pragma once

#include <Eigen/Core>
#include <span>

#include "semvslam/base/result.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// F with pixel_b^T F pixel_a = 0 (homogeneous ideal pixels) for every static point, from a known motion. Zero when the
/// cameras share their centre: then there are no epipolar lines. Hartley & Zisserman, 2nd ed., eq. (9.3).
Eigen::Matrix3d fundamental_from_pose(const Camera& camera_a, const Camera& camera_b, const SE3& b_from_a);

/// Fundamental matrix from at least 8 pairs, all used, least squares on normalised pixels with rank 2 enforced
/// (Hartley, In defense of the eight-point algorithm, PAMI 1997). Unit Frobenius norm.
/// Errors: fewer than 8 pairs, different sizes, not finite, or pairs that many matrices explain (all in one place or on
/// one line, a motion without parallax): then the answer would be arbitrary.
Result<Eigen::Matrix3d> fundamental_eight_point(std::span<const Eigen::Vector2d> pixels_a,
                                                std::span<const Eigen::Vector2d> pixels_b);

/// Distance in px of pixel_b from the epipolar line of pixel_a in image b: |p_b^T F p_a| / sqrt(X^2 + Y^2),
/// (X, Y, Z)^T = F p_a, eq. (4) of the paper. Infinite when there is no line (pixel_a is the epipole, F is zero).
double epipolar_distance_px(const Eigen::Matrix3d& fundamental, const Eigen::Vector2d& pixel_a,
                            const Eigen::Vector2d& pixel_b);

/// First-order distance in px of the pair from the nearest pair that fulfils the constraint exactly; symmetric in the
/// images (Sampson, 1982; Hartley & Zisserman, eq. (11.9), its square root). Infinite where undefined.
double sampson_distance_px(const Eigen::Matrix3d& fundamental, const Eigen::Vector2d& pixel_a,
                           const Eigen::Vector2d& pixel_b);

}  // namespace semvslam
