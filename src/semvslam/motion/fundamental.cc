#include "semvslam/motion/fundamental.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <array>

#include "semvslam/base/ranked.h"
#include "semvslam/geometry/epipolar.h"
#include "semvslam/geometry/ransac.h"

namespace semvslam {
namespace {

using Pixels = std::span<const Eigen::Vector2d>;

struct EpipolarProblem {
  using Model = Eigen::Matrix3d;
  static constexpr int kSampleSize = 8;
  Pixels a, b;

  std::size_t size() const { return a.size(); }
  void hypotheses(const std::array<std::size_t, kSampleSize>& sample, std::vector<Model>& out) const {
    std::array<Eigen::Vector2d, kSampleSize> from, to;
    for (std::size_t k = 0; k < sample.size(); ++k) from[k] = a[sample[k]], to[k] = b[sample[k]];
    if (auto f = fundamental_eight_point(from, to)) out.push_back(*f);
  }
  double squared_residual(const Model& f, std::size_t i) const {
    const Eigen::Vector3d pa(a[i].x(), a[i].y(), 1), pb(b[i].x(), b[i].y(), 1);
    const Eigen::Vector3d line_b = f * pa, line_a = f.transpose() * pb;
    const double e = line_b.dot(pb);
    return e * e / (line_b.head<2>().squaredNorm() + line_a.head<2>().squaredNorm());
  }
};

// Homography from 4 or more pairs by the direct linear transformation on pixels moved and scaled to about +-1.
struct HomographyProblem {
  using Model = Eigen::Matrix3d;
  static constexpr int kSampleSize = 4;
  Pixels a, b;
  Eigen::Vector2d centre;
  double scale = 1;

  std::size_t size() const { return a.size(); }
  // The two constraints of a pair on the nine elements, row by row.
  Eigen::Matrix<double, 9, 2> constraints(std::size_t i) const {
    const Eigen::Vector2d p = scale * (a[i] - centre), q = scale * (b[i] - centre);
    Eigen::Matrix<double, 9, 2> rows;
    rows.col(0) << p.x(), p.y(), 1, 0, 0, 0, -q.x() * p.x(), -q.x() * p.y(), -q.x();
    rows.col(1) << 0, 0, 0, p.x(), p.y(), 1, -q.y() * p.x(), -q.y() * p.y(), -q.y();
    return rows;
  }
  static Model of(const Eigen::Matrix<double, 9, 1>& h) {
    Model m;
    m << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
    return m;
  }
  Model fit(const std::vector<std::size_t>& indices) const {
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    for (const std::size_t i : indices) {
      const auto rows = constraints(i);
      normal += rows * rows.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
    return of(eigen.eigenvectors().col(0));
  }
  // Four pairs are met exactly: by what is orthogonal to all their constraints.
  void hypotheses(const std::array<std::size_t, kSampleSize>& sample, std::vector<Model>& out) const {
    Eigen::Matrix<double, 9, 8> all;
    for (int k = 0; k < kSampleSize; ++k) all.middleCols<2>(2 * k) = constraints(sample[static_cast<std::size_t>(k)]);
    const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 8>> qr(all);
    out.push_back(of(qr.householderQ() * Eigen::Matrix<double, 9, 1>::Unit(8)));
  }
  double squared_residual(const Model& h, std::size_t i) const {
    const Eigen::Vector2d p = scale * (a[i] - centre), q = scale * (b[i] - centre);
    const Eigen::Vector3d mapped = h * p.homogeneous();
    return (mapped.hnormalized() - q).squaredNorm() / (scale * scale);
  }
};

double median_motion(Pixels a, Pixels b) {
  std::vector<double> squared(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) squared[i] = (b[i] - a[i]).squaredNorm();
  return std::sqrt(median(std::span(squared)));
}

// Share of F's inliers that one homography explains to the same accuracy: near 1, the pairs do not tell F.
double homography_share(Pixels a, Pixels b, const FundamentalEstimate& f, const FundamentalOptions& options) {
  std::vector<Eigen::Vector2d> from, to;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (f.inlier[i]) from.push_back(a[i]), to.push_back(b[i]);
  HomographyProblem problem{from, to, Eigen::Vector2d::Zero(), 1};
  for (const auto& p : from) problem.centre += p / static_cast<double>(from.size());
  double distance = 0;
  for (const auto& p : from) distance += (p - problem.centre).norm() / static_cast<double>(from.size());
  if (!(distance > 1)) return 1;
  problem.scale = 1 / distance;
  RansacOptions ransac_options{options.seed, 0.99, 10, 60};
  const double squared_limit = options.inlier_px * options.inlier_px;
  auto found = ransac(problem, squared_limit, ransac_options);
  if (!found.found) return 0;
  for (int round = 0; round < 2; ++round) {
    std::vector<std::size_t> fitting;
    for (std::size_t i = 0; i < from.size(); ++i)
      if (problem.squared_residual(found.model, i) <= squared_limit) fitting.push_back(i);
    if (fitting.size() < 4) break;
    const Eigen::Matrix3d refined = problem.fit(fitting);
    int agree = 0;
    for (std::size_t i = 0; i < from.size(); ++i) agree += problem.squared_residual(refined, i) <= squared_limit;
    if (agree <= found.inliers) break;
    found.model = refined;
    found.inliers = agree;
  }
  return static_cast<double>(found.inliers) / static_cast<double>(from.size());
}

// Least squares on the inliers, then on those that their own scatter leaves: outliers that lie near their line by
// chance would turn it.
void refine(Pixels a, Pixels b, const EpipolarProblem& problem, double squared_limit, FundamentalEstimate& estimate) {
  std::vector<double> squared(a.size());
  for (int round = 0; round < 3; ++round) {
    std::vector<double> of_inliers;
    for (std::size_t i = 0; i < a.size(); ++i) {
      squared[i] = problem.squared_residual(estimate.matrix, i);
      if (squared[i] <= squared_limit) of_inliers.push_back(squared[i]);
    }
    if (of_inliers.size() < 8) return;
    const double sigmas = 3 * 1.4826;  // of the median: three standard deviations
    const double limit = std::min(squared_limit, sigmas * sigmas * median(std::span(of_inliers)));
    std::vector<Eigen::Vector2d> from, to;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (squared[i] <= limit) from.push_back(a[i]), to.push_back(b[i]);
    const auto refined = fundamental_eight_point(from, to);
    if (!refined) return;
    std::vector<std::uint8_t> inlier(a.size());
    int inliers = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      inlier[i] = problem.squared_residual(*refined, i) <= squared_limit;
      inliers += inlier[i];
    }
    if (inliers < 9 * estimate.inliers / 10) return;
    estimate.matrix = *refined;
    estimate.inlier = std::move(inlier);
    estimate.inliers = inliers;
  }
}

}  // namespace

std::string_view to_string(FundamentalState state) {
  switch (state) {
    case FundamentalState::kUsable:
      return "usable";
    case FundamentalState::kTooFewPairs:
      return "too_few_pairs";
    case FundamentalState::kNoConsensus:
      return "no_consensus";
    case FundamentalState::kStill:
      return "still";
    case FundamentalState::kHomography:
      return "homography";
  }
  return "";
}

void FundamentalOptions::add_to(ConfigSchema& schema) {
  schema.add("motion.fundamental.min_pairs", &min_pairs, {8, 1000}, "fewer pairs give no fundamental matrix");
  schema.add("motion.fundamental.inlier_px", &inlier_px, {0.1, 10.0}, "Sampson distance of a pair that agrees, px");
  schema.add("motion.fundamental.still_px", &still_px, {0.0, 50.0},
             "median displacement below which the camera counts as still, px");
  schema.add("motion.fundamental.max_homography_share", &max_homography_share, {0.1, 1.0},
             "share of its pairs that a homography may explain too; above, the matrix is not used");
  schema.add("motion.fundamental.max_iterations", &max_iterations, {10, 10000}, "samples tried at most");
}

FundamentalEstimate estimate_fundamental(Pixels pixels_a, Pixels pixels_b, const FundamentalOptions& options) {
  FundamentalEstimate estimate;
  if (pixels_a.size() != pixels_b.size() || static_cast<int>(pixels_a.size()) < std::max(8, options.min_pairs))
    return estimate;
  estimate.median_motion_px = median_motion(pixels_a, pixels_b);
  if (estimate.median_motion_px < options.still_px) {
    estimate.state = FundamentalState::kStill;
    return estimate;
  }
  const double squared_limit = options.inlier_px * options.inlier_px;
  const EpipolarProblem problem{pixels_a, pixels_b};
  auto found = ransac(problem, squared_limit, RansacOptions{options.seed, 0.99, 10, options.max_iterations});
  estimate.state = FundamentalState::kNoConsensus;
  if (!found.found) return estimate;
  estimate.matrix = found.model;
  estimate.inlier = std::move(found.inlier);
  estimate.inliers = found.inliers;
  if (estimate.inliers >= 8) refine(pixels_a, pixels_b, problem, squared_limit, estimate);
  if (2 * estimate.inliers < static_cast<int>(pixels_a.size()) || estimate.inliers < options.min_pairs) return estimate;
  estimate.homography_share = homography_share(pixels_a, pixels_b, estimate, options);
  estimate.state = estimate.homography_share > options.max_homography_share ? FundamentalState::kHomography
                                                                            : FundamentalState::kUsable;
  return estimate;
}

}  // namespace semvslam
