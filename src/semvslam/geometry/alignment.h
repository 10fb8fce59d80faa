#pragma once

#include <Eigen/Core>
#include <span>

#include "semvslam/base/result.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// How one set of points lies on another: a_i ~ a_from_b * b_i.
struct Alignment {
  Sim3 a_from_b;      // scale 1 unless asked for
  double rmse_m = 0;  // root of the mean squared distance |a_i - a_from_b * b_i|
};

/// The similarity (or rigid motion) that minimises the sum of squared distances between paired points, in closed form:
/// S. Umeyama, Least-squares estimation of transformation parameters between two point patterns, PAMI 1991 (the same
/// minimum as Horn 1987). The result is a rotation, never a reflection.
/// @param a, b paired by index, metres, one frame each. @param with_scale also estimate the scale of b.
/// Errors: fewer than 3 pairs, different sizes, a number that is not finite, or points on one line or in one place (the
/// rotation about that line is not defined; the tool `evo` refuses these too).
Result<Alignment> align_points(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b, bool with_scale);

}  // namespace semvslam
