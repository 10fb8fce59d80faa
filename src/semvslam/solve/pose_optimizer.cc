#include "semvslam/solve/pose_optimizer.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

#include "semvslam/solve/lanes.h"
#include "semvslam/solve/residuals.h"

namespace semvslam {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr int kMinObservations = 3;
constexpr double kRelativeGainToGoOn = 1e-8;  // of the cost, predicted by the linear model
constexpr double kSmallestPivot = 1e-12;      // of the normal matrix scaled to a unit diagonal

// Eight observations. A weight of zero switches a residual off.
struct Block {
  Lanes x, y, z, u, v, disparity;
  Lanes pixel_variance_inverse, disparity_variance_inverse;  // of usable measurements, else 0
  Lanes pixel_weight, disparity_weight;                      // the same while classified as inlier, else 0
};

struct Normal {
  Matrix6 h;
  Vector6 g;
  double cost = 0;
};

struct CameraPoint {
  Lanes x, y, z;
};

class PoseProblem {
 public:
  PoseProblem(const Intrinsics& camera, const PoseOptimizerOptions& options) : camera_(camera), options_(options) {}

  /// @return number of usable observations.
  int load(std::span<const Eigen::Vector3d> points, std::span<const PointObservation> observations);
  Normal linearize(const SE3& pose) const;
  SE3 minimize(SE3 pose) const;
  /// Sets the weights and `inlier` from the residuals at the pose. @return true when any verdict changed.
  bool classify(const SE3& pose, std::vector<std::uint8_t>& inlier);
  int inliers() const { return inliers_; }
  double mean_squared_error() const { return inliers_ > 0 ? inlier_chi2_ / inliers_ : 0.0; }

 private:
  static CameraPoint transform(const Block& b, const Eigen::Matrix3d& r, const Eigen::Vector3d& t) {
    return {r(0, 0) * b.x + r(0, 1) * b.y + r(0, 2) * b.z + t.x(),
            r(1, 0) * b.x + r(1, 1) * b.y + r(1, 2) * b.z + t.y(),
            r(2, 0) * b.x + r(2, 1) * b.y + r(2, 2) * b.z + t.z()};
  }

  Intrinsics camera_;
  PoseOptimizerOptions options_;
  std::vector<Block> blocks_;
  int inliers_ = 0;
  double inlier_chi2_ = 0;
};

int PoseProblem::load(std::span<const Eigen::Vector3d> points, std::span<const PointObservation> observations) {
  blocks_.assign((points.size() + kLanes - 1) / kLanes, Block{});
  int usable = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PointObservation& o = observations[i];
    if (!is_usable(points[i]) || !is_usable(o)) continue;
    Block& b = blocks_[i / kLanes];
    const std::size_t lane = i % kLanes;
    b.x[lane] = points[i].x();
    b.y[lane] = points[i].y();
    b.z[lane] = points[i].z();
    b.u[lane] = o.pixel.x();
    b.v[lane] = o.pixel.y();
    b.pixel_variance_inverse[lane] = o.inverse_variance_px;
    if (has_depth(o)) {
      b.disparity[lane] = o.disparity_px;
      b.disparity_variance_inverse[lane] = o.inverse_variance_disparity;
    }
    ++usable;
  }
  for (Block& b : blocks_) {
    b.pixel_weight = b.pixel_variance_inverse;
    b.disparity_weight = b.disparity_variance_inverse;
  }
  return usable;
}

Normal PoseProblem::linearize(const SE3& pose) const {
  const Eigen::Matrix3d r = pose.rotation_matrix();
  const Eigen::Vector3d t = pose.translation();
  const Lanes zero = broadcast(0), one = broadcast(1), behind_cost = broadcast(kBehindCameraCost);
  const Lanes pixel_limit = broadcast(options_.chi2_pixel), disparity_limit = broadcast(options_.chi2_disparity);
  Lanes h[kPoseEntries] = {}, g[6] = {}, cost = zero;
  for (const Block& b : blocks_) {
    const CameraPoint p = transform(b, r, t);
    const auto in_front = p.z > kMinDepthM;
    const Lanes z = in_front ? p.z : one;
    const Lanes wp = in_front ? b.pixel_weight : zero;
    const Lanes wd = in_front ? b.disparity_weight : zero;
    const ResidualTerms<Lanes> e = residual_terms(camera_, p.x, p.y, z, b.u, b.v, b.disparity);
    const Lanes sp = wp * (e.u * e.u + e.v * e.v), sd = wd * (e.disparity * e.disparity);
    // Huber: below its corner the quotient is exactly 1.
    const Lanes hp = sqrt_lanes(pixel_limit / (sp > pixel_limit ? sp : pixel_limit));
    const Lanes hd = sqrt_lanes(disparity_limit / (sd > disparity_limit ? sd : disparity_limit));
    cost += sp > pixel_limit ? 2 * sp * hp - pixel_limit : sp;
    cost += sd > disparity_limit ? 2 * sd * hd - disparity_limit : sd;
    cost += in_front ? zero : (b.pixel_weight > zero ? behind_cost : zero);
    add_pose_normal(point_information<Lanes>(e, wp * hp, wd * hd), p.x, p.y, z, h, g);
  }
  Normal n;
  double entries[kPoseEntries];
  for (int i = 0; i < kPoseEntries; ++i) entries[i] = sum_lanes(h[i]);
  n.h = unpack_pose_normal(entries);
  for (int i = 0; i < 6; ++i) n.g[i] = sum_lanes(g[i]);
  n.cost = sum_lanes(cost);
  return n;
}

// Levenberg-Marquardt with the damping scaled by the diagonal, nearly Gauss-Newton at first: predictions are close.
SE3 PoseProblem::minimize(SE3 pose) const {
  Normal n = linearize(pose);
  double lambda = 1e-5;
  for (int i = 0; i < options_.iterations_per_round; ++i) {
    Matrix6 damped = n.h;
    damped.diagonal() *= 1 + lambda;
    const Eigen::LDLT<Matrix6> solver(damped);
    const Vector6 step = solver.solve(n.g);
    if (solver.info() != Eigen::Success || !step.allFinite()) break;
    // The cost is twice the usual half sum of squares, hence no factor 1/2 here.
    const double predicted_gain = step.dot(n.g + lambda * n.h.diagonal().cwiseProduct(step));
    if (!(predicted_gain > kRelativeGainToGoOn * n.cost)) break;
    const SE3 candidate = SE3::exp(step) * pose;
    const Normal c = linearize(candidate);
    if (c.cost < n.cost) {
      pose = candidate;
      n = c;
      lambda = std::max(lambda * 0.1, 1e-9);
    } else {
      lambda = std::max(lambda, 1e-4) * 10;
    }
  }
  return pose;
}

bool PoseProblem::classify(const SE3& pose, std::vector<std::uint8_t>& inlier) {
  const Eigen::Matrix3d r = pose.rotation_matrix();
  const Eigen::Vector3d t = pose.translation();
  const Lanes zero = broadcast(0), one = broadcast(1);
  bool changed = false;
  inliers_ = 0;
  inlier_chi2_ = 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    Block& b = blocks_[k];
    const CameraPoint p = transform(b, r, t);
    const auto in_front = p.z > kMinDepthM;
    const ResidualTerms<Lanes> e =
        residual_terms<Lanes>(camera_, p.x, p.y, in_front ? p.z : one, b.u, b.v, b.disparity);
    const Lanes sp = b.pixel_variance_inverse * (e.u * e.u + e.v * e.v);
    const Lanes sd = b.disparity_variance_inverse * (e.disparity * e.disparity);
    const Lanes seen = in_front ? b.pixel_variance_inverse : zero;
    const Lanes wp = sp <= options_.chi2_pixel ? seen : zero;
    const Lanes wd = sd <= options_.chi2_disparity ? (wp > zero ? b.disparity_variance_inverse : zero) : zero;
    const std::size_t count = std::min<std::size_t>(kLanes, inlier.size() - k * kLanes);
    for (std::size_t i = 0; i < count; ++i) {
      changed |= wp[i] != b.pixel_weight[i] || wd[i] != b.disparity_weight[i];
      inlier[k * kLanes + i] = wp[i] > 0;
      if (wp[i] > 0) {
        ++inliers_;
        inlier_chi2_ += sp[i];
      }
    }
    b.pixel_weight = wp;
    b.disparity_weight = wd;
  }
  return changed;
}

bool observes_six_directions(const Matrix6& h) {
  const Vector6 diagonal = h.diagonal();
  if (!h.allFinite() || !(diagonal.minCoeff() > 0)) return false;
  const Vector6 s = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Matrix6> solver(Matrix6(s.asDiagonal() * h * s.asDiagonal()));
  return solver.info() == Eigen::Success && solver.vectorD().minCoeff() > kSmallestPivot;
}

}  // namespace

PoseEstimate optimize_pose(const Intrinsics& camera, const SE3& initial,
                           std::span<const Eigen::Vector3d> points_in_world,
                           std::span<const PointObservation> observations, const PoseOptimizerOptions& options,
                           std::vector<std::uint8_t>& inlier) {
  if (points_in_world.size() != observations.size())
    throw std::invalid_argument("optimize_pose: points and observations differ in number");
  PoseEstimate out;
  out.camera_from_world = initial;
  inlier.assign(observations.size(), 0);
  const auto give_up = [&] {
    inlier.assign(observations.size(), 0);
    return out;
  };
  PoseProblem problem(camera, options);
  if (!is_usable(camera) || !initial.is_finite()) return give_up();
  if (problem.load(points_in_world, observations) < kMinObservations) return give_up();

  SE3 pose = initial;
  for (int round = 0; round < options.rounds; ++round) {
    pose = problem.minimize(pose);
    const bool changed = problem.classify(pose, inlier);
    if (problem.inliers() < kMinObservations) return give_up();
    if (!changed && round > 0) break;
  }
  const Normal n = problem.linearize(pose);
  if (!pose.is_finite() || !observes_six_directions(n.h)) return give_up();
  out.camera_from_world = pose;
  out.inliers = problem.inliers();
  out.mean_squared_error = problem.mean_squared_error();
  out.information = n.h;
  return out;
}

}  // namespace semvslam
