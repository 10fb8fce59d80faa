#include "semvslam/solve/bundle_adjustment_ceres.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "semvslam/solve/residuals.h"

namespace semvslam {
namespace {

using RowMajor67 = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;

SE3 pose_of(const double* p) { return {Eigen::Quaterniond(p[3], p[0], p[1], p[2]), Eigen::Vector3d(p[4], p[5], p[6])}; }

void store(const SE3& pose, double* p) {
  std::copy_n(pose.rotation().coeffs().data(), 4, p);
  std::copy_n(pose.translation().data(), 3, p + 4);
}

// Poses as (qx, qy, qz, qw, t) with the left increment of the rest of this module. The cost functions below write their
// derivative by that increment into the first six of seven columns, so the derivative of "plus" is the identity there.
void plus(const double* x, const double* delta, double* out) {
  store(SE3::exp(Eigen::Map<const SE3::Tangent>(delta)) * pose_of(x), out);
}
void plus_jacobian(double* jacobian) { Eigen::Map<RowMajor67>(jacobian).setIdentity(); }

#if CERES_VERSION_MAJOR > 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR >= 1)
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* out) const override {
    plus(x, delta, out);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    plus_jacobian(jacobian);
    return true;
  }
  bool Minus(const double* y, const double* x, double* out) const override {
    const SE3::Tangent difference = (pose_of(y) * pose_of(x).inverse()).log();
    std::copy_n(difference.data(), 6, out);
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};
void add_pose(ceres::Problem& problem, double* pose) { problem.AddParameterBlock(pose, 7, new PoseManifold); }
#else
class PoseParameterization final : public ceres::LocalParameterization {
 public:
  int GlobalSize() const override { return 7; }
  int LocalSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* out) const override {
    plus(x, delta, out);
    return true;
  }
  bool ComputeJacobian(const double*, double* jacobian) const override {
    plus_jacobian(jacobian);
    return true;
  }
};
void add_pose(ceres::Problem& problem, double* pose) { problem.AddParameterBlock(pose, 7, new PoseParameterization); }
#endif

// Rows [kFirst, kFirst + kRows) of the dense residual, weighted.
template <int kFirst, int kRows>
class ObservationCost final : public ceres::SizedCostFunction<kRows, 7, 3> {
 public:
  ObservationCost(const Intrinsics& camera, const PointObservation& observation, double inverse_variance)
      : camera_(camera), observation_(observation), inverse_sigma_(std::sqrt(inverse_variance)) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Vector3d point(parameters[1][0], parameters[1][1], parameters[1][2]);
    const DenseResidual r = dense_residual(camera_, pose_of(parameters[0]), point, observation_);
    if (!r.valid) return false;  // Ceres then takes a smaller step
    Eigen::Map<Eigen::Matrix<double, kRows, 1>>(residuals).noalias() =
        inverse_sigma_ * r.value.template segment<kRows>(kFirst);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kRows, 7, Eigen::RowMajor>> j(jacobians[0]);
      j.template leftCols<6>() = inverse_sigma_ * r.by_pose.template middleRows<kRows>(kFirst);
      j.col(6).setZero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kRows, 3, Eigen::RowMajor>> j(jacobians[1]);
      j = inverse_sigma_ * r.by_point.template middleRows<kRows>(kFirst);
    }
    return true;
  }

 private:
  Intrinsics camera_;
  PointObservation observation_;
  double inverse_sigma_;
};
using PixelCost = ObservationCost<0, 2>;
using DisparityCost = ObservationCost<2, 1>;

struct Active {
  bool pixel = false, disparity = false;
};

void switch_off_weak_points(const BaProblem& problem, std::vector<Active>& active) {
  std::vector<std::array<int, 2>> count(problem.points.size(), {0, 0});
  for (std::size_t i = 0; i < active.size(); ++i) {
    count[problem.edges[i].point][0] += active[i].pixel;
    count[problem.edges[i].point][1] += active[i].disparity;
  }
  for (std::size_t i = 0; i < active.size(); ++i) {
    const auto& c = count[problem.edges[i].point];
    if (c[0] < 2 && c[1] < 1) active[i] = {};
  }
}

std::vector<Active> inliers_of(const BaProblem& problem, const BaOptions& options) {
  std::vector<Active> active(problem.edges.size());
  for (std::size_t i = 0; i < active.size(); ++i) {
    const auto& e = problem.edges[i];
    const PointObservation& o = e.observation;
    if (!is_usable(o) || !is_usable(problem.points[e.point])) continue;
    const DenseResidual r = dense_residual(problem.camera, problem.poses[e.pose], problem.points[e.point], o);
    if (!r.valid) continue;
    active[i].pixel = o.inverse_variance_px * r.value.head<2>().squaredNorm() <= options.chi2_pixel;
    active[i].disparity = active[i].pixel && has_depth(o) &&
                          o.inverse_variance_disparity * r.value.z() * r.value.z() <= options.chi2_disparity;
  }
  return active;
}

void solve_pass(BaProblem& problem, const BaOptions& options, const std::vector<Active>& active, int iterations,
                BaSummary& summary) {
  std::vector<std::array<double, 7>> poses(problem.poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) store(problem.poses[i], poses[i].data());
  ceres::Problem ceres_problem;
  auto* ordering = new ceres::ParameterBlockOrdering;
  std::vector<std::uint8_t> used_pose(poses.size(), 0), used_point(problem.points.size(), 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!active[i].pixel) continue;
    const auto& e = problem.edges[i];
    double* pose = poses[e.pose].data();
    double* point = problem.points[e.point].data();
    if (!used_pose[e.pose]) {
      add_pose(ceres_problem, pose);
      if (problem.pose_fixed[e.pose]) ceres_problem.SetParameterBlockConstant(pose);
      ordering->AddElementToGroup(pose, 1);
      used_pose[e.pose] = 1;
    }
    if (!used_point[e.point]) {
      ordering->AddElementToGroup(point, 0);
      used_point[e.point] = 1;
    }
    ceres_problem.AddResidualBlock(new PixelCost(problem.camera, e.observation, e.observation.inverse_variance_px),
                                   new ceres::HuberLoss(std::sqrt(options.chi2_pixel)), pose, point);
    if (active[i].disparity)
      ceres_problem.AddResidualBlock(
          new DisparityCost(problem.camera, e.observation, e.observation.inverse_variance_disparity),
          new ceres::HuberLoss(std::sqrt(options.chi2_disparity)), pose, point);
  }
  ceres::Solver::Options o;
  o.linear_solver_type = ceres::DENSE_SCHUR;
  o.linear_solver_ordering.reset(ordering);
  o.max_num_iterations = iterations;
  o.function_tolerance = options.relative_cost_tolerance;
  o.gradient_tolerance = 0;
  o.parameter_tolerance = 0;
  o.num_threads = 1;
  o.logging_type = ceres::SILENT;
  ceres::Solver::Summary s;
  ceres::Solve(o, &ceres_problem, &s);
  if (!s.IsSolutionUsable()) {
    summary.usable = false;
    return;
  }
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (used_pose[i] && !problem.pose_fixed[i]) problem.poses[i] = pose_of(poses[i].data());
  summary.iterations += static_cast<int>(s.iterations.size()) - 1;
  summary.accepted_steps += s.num_successful_steps;
  summary.final_cost = 2 * s.final_cost;
  if (summary.initial_cost == 0) summary.initial_cost = 2 * s.initial_cost;
}

}  // namespace

BaSummary adjust_bundle_ceres(BaProblem& problem, const BaOptions& options, std::vector<std::uint8_t>& edge_inlier) {
  BaSummary summary;
  BaProblem work = problem;
  std::vector<Active> active(problem.edges.size());
  for (std::size_t i = 0; i < active.size(); ++i) {
    const auto& e = problem.edges[i];
    const double z = (problem.poses[e.pose] * problem.points[e.point]).z();
    active[i].pixel = is_usable(e.observation) && z > kMinDepthM;
    active[i].disparity = active[i].pixel && has_depth(e.observation);
  }
  switch_off_weak_points(work, active);
  solve_pass(work, options, active, options.robust_iterations, summary);
  if (summary.usable) {
    active = inliers_of(work, options);
    switch_off_weak_points(work, active);
    solve_pass(work, options, active, options.final_iterations, summary);
  }
  edge_inlier.assign(problem.edges.size(), 0);
  if (summary.usable) {
    problem = std::move(work);
    active = inliers_of(problem, options);
    for (std::size_t i = 0; i < active.size(); ++i) edge_inlier[i] = active[i].pixel;
  }
  for (const std::uint8_t inlier : edge_inlier) summary.outlier_edges += !inlier;
  return summary;
}

}  // namespace semvslam
