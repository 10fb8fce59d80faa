#include "semvslam/geometry/alignment.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <cmath>

namespace semvslam {
namespace {

Error no_alignment(const std::string& why) { return {ErrorCode::kInvalidInput, "align points: " + why}; }

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

}  // namespace

Result<Alignment> align_points(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b,
                               bool with_scale) {
  if (a.size() != b.size()) return no_alignment(fmt::format("{} and {} points cannot be paired", a.size(), b.size()));
  if (a.size() < 3) return no_alignment(fmt::format("at least 3 pairs are needed, got {}", a.size()));
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!a[i].allFinite() || !b[i].allFinite()) return no_alignment(fmt::format("pair {} is not finite", i));

  const double n = static_cast<double>(a.size());
  const Eigen::Vector3d mean_a = mean_of(a), mean_b = mean_of(b);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double variance_b = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    covariance += (a[i] - mean_a) * (b[i] - mean_b).transpose();
    variance_b += (b[i] - mean_b).squaredNorm();
  }
  covariance /= n;
  variance_b /= n;

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d d = svd.singularValues();
  // A second singular value within rounding of zero leaves the rotation about the line free.
  if (!(d[0] > 1e-18) || !(d[1] > 1e-14 * d[0])) return no_alignment("the points lie on one line or in one place");
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign.z() = -1;

  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  Alignment out;
  out.a_from_b.scale = with_scale ? d.dot(sign) / variance_b : 1.0;
  out.a_from_b.rigid = SE3(rotation, mean_a - out.a_from_b.scale * (rotation * mean_b));
  double squared = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squared += (a[i] - out.a_from_b * b[i]).squaredNorm();
  out.rmse_m = std::sqrt(squared / n);
  return out;
}

}  // namespace semvslam
