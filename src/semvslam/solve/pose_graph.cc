#include "semvslam/solve/pose_graph.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "semvslam/geometry/se3_jacobian.h"
#include "semvslam/solve/residuals.h"

namespace semvslam {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Sparse = Eigen::SparseMatrix<double>;

constexpr double kFirstGraphLambda = 1e-6, kSmallestGraphLambda = 1e-12, kLargestGraphLambda = 1e8;

class PoseGraph {
 public:
  PoseGraph(const PoseGraphProblem& problem, const PoseGraphOptions& options);
  bool usable() const { return usable_; }
  double cost(const std::vector<SE3>& poses) const;
  /// Normal equations at the present poses.
  void linearize();
  /// @return false when the damped system is not positive definite.
  bool solve(double lambda);
  double predicted_gain(double lambda) const {
    return step_.dot(rhs_) + lambda * diagonal_.dot(step_.cwiseProduct(step_));
  }
  std::vector<SE3> moved() const;
  std::vector<SE3> poses;

 private:
  void find_movable();
  bool is_active(const PoseGraphProblem::Edge& e) const { return e.a != e.b && (index_[e.a] >= 0 || index_[e.b] >= 0); }
  void add_block(int row, int column, const Matrix6& block);

  const PoseGraphProblem& problem_;
  PoseGraphOptions options_;
  bool usable_ = false;
  std::vector<int> index_;  // of each movable pose, -1 of the others
  int movable_ = 0;
  std::vector<Eigen::Triplet<double>> triplets_;
  Sparse h_;  // lower triangle
  Eigen::VectorXd rhs_, diagonal_, step_;
  Eigen::SimplicialLDLT<Sparse> solver_;
  bool analyzed_ = false;
};

PoseGraph::PoseGraph(const PoseGraphProblem& problem, const PoseGraphOptions& options)
    : poses(problem.world_from_pose), problem_(problem), options_(options) {
  if (problem.fixed.size() != problem.world_from_pose.size())
    throw std::invalid_argument("optimize_pose_graph: fixed must have one entry per pose");
  bool finite = true;
  for (const SE3& pose : problem.world_from_pose) finite &= pose.is_finite();
  for (const auto& e : problem.edges) {
    if (e.a >= poses.size() || e.b >= poses.size())
      throw std::invalid_argument("optimize_pose_graph: an edge refers to a pose that is not there");
    finite &= e.a_from_b.is_finite() && e.information.allFinite();
  }
  find_movable();
  usable_ = finite && movable_ > 0;
}

// Movable: not fixed, and connected to a fixed pose.
void PoseGraph::find_movable() {
  std::vector<std::uint32_t> root(poses.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (const auto& e : problem_.edges) root[find(e.a)] = find(e.b);
  std::vector<std::uint8_t> anchored(poses.size(), 0);
  for (std::uint32_t i = 0; i < poses.size(); ++i)
    if (problem_.fixed[i]) anchored[find(i)] = 1;
  index_.assign(poses.size(), -1);
  for (std::uint32_t i = 0; i < poses.size(); ++i)
    if (!problem_.fixed[i] && anchored[find(i)]) index_[i] = movable_++;
}

double PoseGraph::cost(const std::vector<SE3>& at) const {
  double sum = 0;
  for (const auto& e : problem_.edges) {
    if (!is_active(e)) continue;
    const SE3::Tangent r = (e.a_from_b.inverse() * at[e.a].inverse() * at[e.b]).log();
    const double s = r.dot(e.information * r);
    sum += options_.huber_chi2 > 0 ? huber_cost(s, options_.huber_chi2) : s;
  }
  return sum;
}

void PoseGraph::add_block(int row, int column, const Matrix6& block) {
  for (int c = 0; c < 6; ++c)
    for (int r = 0; r < 6; ++r)
      if (6 * row + r >= 6 * column + c) triplets_.emplace_back(6 * row + r, 6 * column + c, block(r, c));
}

void PoseGraph::linearize() {
  triplets_.clear();
  rhs_.setZero(6 * movable_);
  for (const auto& e : problem_.edges) {
    if (!is_active(e)) continue;
    const PoseGraphResidual r = pose_graph_residual(e.a_from_b, poses[e.a], poses[e.b]);
    Matrix6 information = e.information;
    if (options_.huber_chi2 > 0) information *= huber_weight(r.value.dot(e.information * r.value), options_.huber_chi2);
    const Matrix6 weighted = r.by_b.transpose() * information;
    const Matrix6 h = weighted * r.by_b;
    const SE3::Tangent g = weighted * r.value;
    const int a = index_[e.a], b = index_[e.b];
    if (b >= 0) {
      add_block(b, b, h);
      rhs_.segment<6>(6 * b) -= g;
    }
    if (a >= 0) {
      add_block(a, a, h);
      rhs_.segment<6>(6 * a) += g;
    }
    if (a >= 0 && b >= 0) add_block(std::max(a, b), std::min(a, b), -h);  // h is symmetric
  }
  h_.resize(6 * movable_, 6 * movable_);
  h_.setFromTriplets(triplets_.begin(), triplets_.end());
  diagonal_ = h_.diagonal();
}

bool PoseGraph::solve(double lambda) {
  Sparse damped = h_;
  damped.diagonal() += lambda * diagonal_;
  if (!analyzed_) {
    solver_.analyzePattern(damped);
    analyzed_ = true;
  }
  solver_.factorize(damped);
  if (solver_.info() != Eigen::Success || !(solver_.vectorD().minCoeff() > 0)) return false;
  step_ = solver_.solve(rhs_);
  return step_.allFinite();
}

std::vector<SE3> PoseGraph::moved() const {
  std::vector<SE3> out = poses;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (index_[i] >= 0) out[i] = SE3::exp(step_.segment<6>(6 * index_[i])) * out[i];
  return out;
}

}  // namespace

PoseGraphResidual pose_graph_residual(const SE3& measured_a_from_b, const SE3& world_from_a, const SE3& world_from_b) {
  // With E = measured^-1 W_a^-1 W_b, increments give E exp(Ad(W_b^-1) (d_b - d_a)).
  PoseGraphResidual r;
  const SE3 pose_from_world = world_from_b.inverse();
  r.value = (measured_a_from_b.inverse() * world_from_a.inverse() * world_from_b).log();
  r.by_b = right_jacobian_inverse(r.value) * adjoint(pose_from_world);
  return r;
}

PoseGraphSummary optimize_pose_graph(PoseGraphProblem& problem, const PoseGraphOptions& options, std::stop_token stop) {
  PoseGraphSummary summary;
  PoseGraph graph(problem, options);
  summary.usable = graph.usable();
  if (!summary.usable) return summary;
  double cost = summary.initial_cost = graph.cost(graph.poses), lambda = kFirstGraphLambda;
  graph.linearize();
  for (; summary.iterations < options.max_iterations && lambda < kLargestGraphLambda; ++summary.iterations) {
    summary.stopped = stop.stop_requested();
    if (summary.stopped) break;
    if (!graph.solve(lambda)) {
      lambda *= 10;
      continue;
    }
    if (graph.predicted_gain(lambda) <= 1e-14 * summary.initial_cost) break;
    std::vector<SE3> candidate = graph.moved();
    const double candidate_cost = graph.cost(candidate);
    if (!(candidate_cost < cost)) {
      lambda = std::max(lambda, 1e-5) * 10;
      continue;
    }
    const double gain = cost - candidate_cost;
    graph.poses = std::move(candidate);
    cost = candidate_cost;
    ++summary.accepted_steps;
    lambda = std::max(lambda * 0.1, kSmallestGraphLambda);
    if (gain <= options.relative_cost_tolerance * cost) break;
    graph.linearize();
  }
  summary.final_cost = cost;
  problem.world_from_pose = std::move(graph.poses);
  return summary;
}

}  // namespace semvslam
