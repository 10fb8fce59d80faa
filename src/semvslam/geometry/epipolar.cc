#include "semvslam/geometry/epipolar.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <optional>

namespace semvslam {
namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSmallestShare = 1e-10;  // of the second smallest eigenvalue: below, the solution is not unique

Error no_matrix(const std::string& why) { return {ErrorCode::kInvalidInput, "fundamental matrix: " + why}; }

Eigen::Matrix3d inverse_intrinsics(const Camera& c) {
  Eigen::Matrix3d k;
  k << 1 / c.fx_px, 0, -c.cx_px / c.fx_px, 0, 1 / c.fy_px, -c.cy_px / c.fy_px, 0, 0, 1;
  return k;
}

// Moves the centroid to the origin and the mean distance from it to sqrt(2). A zero scale: all pixels in one place.
struct Normalization {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double scale = 0;

  explicit Normalization(std::span<const Eigen::Vector2d> pixels) {
    for (const auto& p : pixels) centre += p;
    centre /= static_cast<double>(pixels.size());
    double distance = 0;
    for (const auto& p : pixels) distance += (p - centre).norm();
    distance /= static_cast<double>(pixels.size());
    if (distance > 1e-9) scale = std::sqrt(2.0) / distance;
  }
  Eigen::Vector2d operator()(const Eigen::Vector2d& p) const { return scale * (p - centre); }
  Eigen::Matrix3d matrix() const {
    Eigen::Matrix3d m;
    m << scale, 0, -scale * centre.x(), 0, scale, -scale * centre.y(), 0, 0, 1;
    return m;
  }
};

Vector9 constraint(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  Vector9 row;
  row << b.x() * a.x(), b.x() * a.y(), b.x(), b.y() * a.x(), b.y() * a.y(), b.y(), a.x(), a.y(), 1;
  return row;
}

// The nine elements of F, row by row, that eight pairs allow: what is orthogonal to all their constraints. A RANSAC
// would spend most of its time in least squares over its samples of eight. None: not unique.
std::optional<Vector9> exact_solution(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b,
                                      const Normalization& normal_a, const Normalization& normal_b) {
  Eigen::Matrix<double, 9, 8> constraints;
  for (int i = 0; i < 8; ++i) {
    const auto k = static_cast<std::size_t>(i);
    constraints.col(i) = constraint(normal_a(a[k]), normal_b(b[k]));
  }
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 9, 8>> qr(constraints);
  const double largest = qr.matrixR()(0, 0), smallest = qr.matrixR()(7, 7);
  if (!(smallest * smallest > kSmallestShare * largest * largest)) return std::nullopt;
  return Vector9(qr.householderQ() * Vector9::Unit(8));
}

// Of more than eight pairs.
std::optional<Vector9> least_squares(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b,
                                     const Normalization& normal_a, const Normalization& normal_b) {
  Matrix9 normal = Matrix9::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vector9 row = constraint(normal_a(a[i]), normal_b(b[i]));
    normal += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(normal);
  const Vector9 values = eigen.eigenvalues();
  if (eigen.info() != Eigen::Success || !(values[1] > kSmallestShare * values[8])) return std::nullopt;
  return Vector9(eigen.eigenvectors().col(0));
}

}  // namespace

Eigen::Matrix3d fundamental_from_pose(const Camera& camera_a, const Camera& camera_b, const SE3& b_from_a) {
  const Eigen::Matrix3d essential = skew(b_from_a.translation()) * b_from_a.rotation_matrix();
  return inverse_intrinsics(camera_b).transpose() * essential * inverse_intrinsics(camera_a);
}

Result<Eigen::Matrix3d> fundamental_eight_point(std::span<const Eigen::Vector2d> pixels_a,
                                                std::span<const Eigen::Vector2d> pixels_b) {
  if (pixels_a.size() != pixels_b.size())
    return no_matrix(fmt::format("{} and {} pixels cannot be paired", pixels_a.size(), pixels_b.size()));
  if (pixels_a.size() < 8) return no_matrix(fmt::format("at least 8 pairs are needed, got {}", pixels_a.size()));
  for (std::size_t i = 0; i < pixels_a.size(); ++i)
    if (!pixels_a[i].allFinite() || !pixels_b[i].allFinite()) return no_matrix(fmt::format("pair {} is not finite", i));
  const Normalization normal_a(pixels_a), normal_b(pixels_b);
  if (!(normal_a.scale > 0) || !(normal_b.scale > 0)) return no_matrix("all pixels are in one place");

  const std::optional<Vector9> solution = pixels_a.size() == 8 ? exact_solution(pixels_a, pixels_b, normal_a, normal_b)
                                                               : least_squares(pixels_a, pixels_b, normal_a, normal_b);
  if (!solution) return no_matrix("the pairs allow many solutions (one line, one plane or no parallax)");
  const Vector9& f = *solution;
  Eigen::Matrix3d m;
  m << f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8];
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d s = svd.singularValues();
  m = svd.matrixU() * Eigen::Vector3d(s[0], s[1], 0).asDiagonal() * svd.matrixV().transpose();
  m = normal_b.matrix().transpose() * m * normal_a.matrix();
  return Eigen::Matrix3d(m / m.norm());
}

double epipolar_distance_px(const Eigen::Matrix3d& fundamental, const Eigen::Vector2d& pixel_a,
                            const Eigen::Vector2d& pixel_b) {
  const Eigen::Vector3d line = fundamental * pixel_a.homogeneous();
  const double norm = line.head<2>().norm();
  return norm > 0 ? std::abs(line.dot(pixel_b.homogeneous())) / norm : kInfinity;
}

double sampson_distance_px(const Eigen::Matrix3d& fundamental, const Eigen::Vector2d& pixel_a,
                           const Eigen::Vector2d& pixel_b) {
  const Eigen::Vector3d line_b = fundamental * pixel_a.homogeneous();
  const Eigen::Vector3d line_a = fundamental.transpose() * pixel_b.homogeneous();
  const double norm = std::sqrt(line_b.head<2>().squaredNorm() + line_a.head<2>().squaredNorm());
  return norm > 0 ? std::abs(line_b.dot(pixel_b.homogeneous())) / norm : kInfinity;
}

}  // namespace semvslam
