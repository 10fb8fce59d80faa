#include "semvslam/solve/schur_sweep.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace semvslam {
namespace {

constexpr double kBehindCameraCost =
    1e4;  // of an active edge whose point goes behind the camera: no step may gain by it
constexpr double kSmallestPivot = 1e-14;  // of a point's block, relative to its diagonal

}  // namespace

SchurSweep::SchurSweep(const BaProblem& problem, double pixel_limit, double disparity_limit)
    : camera_(problem.camera), pixel_limit_(pixel_limit), disparity_limit_(disparity_limit) {
  if (problem.pose_fixed.size() != problem.poses.size())
    throw std::invalid_argument("adjust_bundle: pose_fixed must have one entry per pose");
  for (const BaProblem::Edge& e : problem.edges)
    if (e.pose >= problem.poses.size() || e.point >= problem.points.size())
      throw std::invalid_argument("adjust_bundle: an edge refers to a pose or point that is not there");

  poses_ = problem.poses;
  points_ = problem.points;
  load(problem);
  bool finite = is_usable(camera_), any_fixed = false;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    finite &= poses_[i].is_finite();
    any_fixed |= problem.pose_fixed[i] != 0;
  }
  for (const SE3& pose : poses_) matrices_.emplace_back(pose);
  candidate_poses_ = poses_;
  candidate_matrices_ = matrices_;
  candidate_points_ = points_;
  const bool any_edge = std::any_of(edges_.begin(), edges_.end(), [](const Edge& e) { return e.pixel_weight > 0; });
  usable_ = finite && any_fixed && any_edge;
  if (!usable_) return;
  pose_normals_.resize(free_poses_.size());
  couplings_.resize(edges_.size());
  eliminated_.resize(points_.size());
  z_.resize(poses_.size());
  z_pose_.resize(poses_.size());
  schur_rhs_.resize(free_poses_.size());
  schur_.resize(free_poses_.size() * (free_poses_.size() + 1) / 2);
  const auto n = static_cast<Eigen::Index>(6 * free_poses_.size());
  reduced_.resize(n, n);
  reduced_rhs_.resize(n);
  pose_step_.resize(n);
}

// Sorts the edges by point and, inside a point, by pose (two stable counting sorts): the sums do not depend on their
// order in the problem.
void SchurSweep::load(const BaProblem& problem) {
  std::vector<std::int32_t> free_index(poses_.size(), -1);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (problem.pose_fixed[i]) continue;
    free_index[i] = static_cast<std::int32_t>(free_poses_.size());
    free_poses_.push_back(static_cast<std::uint32_t>(i));
  }
  const std::size_t n = problem.edges.size();
  std::vector<std::uint32_t> by_pose(n), begin(poses_.size() + 1, 0);
  for (const auto& e : problem.edges) ++begin[e.pose + 1];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  for (std::size_t i = 0; i < n; ++i) by_pose[begin[problem.edges[i].pose]++] = static_cast<std::uint32_t>(i);

  edge_begin_.assign(points_.size() + 1, 0);
  for (const auto& e : problem.edges) ++edge_begin_[e.point + 1];
  for (std::size_t i = 1; i < edge_begin_.size(); ++i) edge_begin_[i] += edge_begin_[i - 1];
  std::vector<std::uint32_t> next(edge_begin_.begin(), edge_begin_.end() - 1);
  edges_.resize(n);
  for (const std::uint32_t i : by_pose) {
    const BaProblem::Edge& from = problem.edges[i];
    const std::uint32_t slot = next[from.point]++;
    Edge& e = edges_[slot];
    e.pose = from.pose;
    e.free = free_index[from.pose];
    e.original = i;
    if (slot > edge_begin_[from.point] && edges_[slot - 1].pose == e.pose)
      throw std::invalid_argument("adjust_bundle: a point has two edges to the same pose");
    if (!is_usable(from.observation) || !points_[from.point].allFinite()) continue;
    e.u = from.observation.pixel.x();
    e.v = from.observation.pixel.y();
    e.pixel_weight = e.pixel_variance_inverse = from.observation.inverse_variance_px;
    if (!has_depth(from.observation)) continue;
    e.disparity = from.observation.disparity_px;
    e.disparity_weight = e.disparity_variance_inverse = from.observation.inverse_variance_disparity;
  }
  switch_off_weak_points();
}

// One pixel without depth does not fix a point: such a point follows nothing and must not pull its pose.
void SchurSweep::switch_off_weak_points() {
  for (std::size_t i = 0; i + 1 < edge_begin_.size(); ++i) {
    int pixels = 0, depths = 0;
    for (std::uint32_t k = edge_begin_[i]; k < edge_begin_[i + 1]; ++k) {
      pixels += edges_[k].pixel_weight > 0;
      depths += edges_[k].disparity_weight > 0;
    }
    if (pixels >= 2 || depths >= 1) continue;
    for (std::uint32_t k = edge_begin_[i]; k < edge_begin_[i + 1]; ++k)
      edges_[k].pixel_weight = edges_[k].disparity_weight = 0;
  }
}

double SchurSweep::edge_cost(const Edge& e, const Eigen::Vector3d& p) const {
  if (!(p.z() > kMinDepthM)) return kBehindCameraCost;
  const ResidualTerms<double> r = residual_terms(camera_, p.x(), p.y(), p.z(), e.u, e.v, e.disparity);
  return huber_cost(e.pixel_weight * (r.u * r.u + r.v * r.v), pixel_limit_) +
         huber_cost(e.disparity_weight * r.disparity * r.disparity, disparity_limit_);
}

double SchurSweep::cost() const {
  double sum = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (std::uint32_t k = edge_begin_[i]; k < edge_begin_[i + 1]; ++k) {
      const Edge& e = edges_[k];
      if (e.pixel_weight > 0) sum += edge_cost(e, matrices_[e.pose].r * points_[i] + matrices_[e.pose].t);
    }
  }
  return sum;
}

bool SchurSweep::Eliminated::factor(const Eigen::Matrix3d& h, double lambda) {
  diagonal = h.diagonal();
  const Eigen::Vector3d d = diagonal * (1 + lambda);
  moves = false;
  if (!(d[0] > 0)) return false;
  inverse_l00 = 1 / std::sqrt(d[0]);
  l10 = h(1, 0) * inverse_l00;
  l20 = h(2, 0) * inverse_l00;
  const double d11 = d[1] - l10 * l10;
  if (!(d11 > kSmallestPivot * d[1])) return false;
  inverse_l11 = 1 / std::sqrt(d11);
  l21 = (h(2, 1) - l20 * l10) * inverse_l11;
  const double d22 = d[2] - l20 * l20 - l21 * l21;
  if (!(d22 > kSmallestPivot * d[2])) return false;
  inverse_l22 = 1 / std::sqrt(d22);
  y[0] = g[0] * inverse_l00;
  y[1] = (g[1] - l10 * y[0]) * inverse_l11;
  y[2] = (g[2] - l20 * y[0] - l21 * y[1]) * inverse_l22;
  moves = true;
  return true;
}

void SchurSweep::eliminate_point(std::size_t point, double lambda) {
  Eliminated& el = eliminated_[point];
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  el.g.setZero();
  std::size_t count = 0;
  for (std::uint32_t k = edge_begin_[point]; k < edge_begin_[point + 1]; ++k) {
    const Edge& e = edges_[k];
    if (!(e.pixel_weight > 0)) continue;
    const PoseMatrix& pose = matrices_[e.pose];
    Coupling& c = couplings_[k];
    c.p = pose.r * points_[point] + pose.t;
    if (!(c.p.z() > kMinDepthM)) continue;
    const ResidualTerms<double> r = residual_terms(camera_, c.p.x(), c.p.y(), c.p.z(), e.u, e.v, e.disparity);
    const double wp = e.pixel_weight * huber_weight(e.pixel_weight * (r.u * r.u + r.v * r.v), pixel_limit_);
    const double wd =
        e.disparity_weight * huber_weight(e.disparity_weight * r.disparity * r.disparity, disparity_limit_);
    const PointInformation<double> m = point_information(r, wp, wd);
    c.n.row(0) = m.xx * pose.r.row(0) + m.xz * pose.r.row(2);
    c.n.row(1) = m.yy * pose.r.row(1) + m.yz * pose.r.row(2);
    c.n.row(2) = m.xz * pose.r.row(0) + m.yz * pose.r.row(1) + m.zz * pose.r.row(2);
    h.noalias() += pose.r.transpose() * c.n;
    el.g.noalias() += pose.r.transpose() * Eigen::Vector3d(m.gx, m.gy, m.gz);
    if (e.free < 0) continue;
    PoseNormal& pn = pose_normals_[static_cast<std::size_t>(e.free)];
    add_pose_normal(m, c.p.x(), c.p.y(), c.p.z(), pn.h, pn.g);
    z_pose_[count] = static_cast<std::uint32_t>(e.free);
    Columns3& w = z_[count++];
    for (int col = 0; col < 3; ++col) {
      const Eigen::Vector3d n = c.n.col(col), pn_cross = c.p.cross(n);
      w[static_cast<std::size_t>(col)] = Lanes{n[0], n[1], n[2], pn_cross[0], pn_cross[1], pn_cross[2], 0, 0};
    }
  }
  if (el.factor(h, lambda)) subtract_schur(el, count);
}

void SchurSweep::subtract_schur(const Eliminated& el, std::size_t count) {
  for (std::size_t a = 0; a < count; ++a) {
    Columns3& z = z_[a];
    z[0] = z[0] * el.inverse_l00;
    z[1] = (z[1] - z[0] * el.l10) * el.inverse_l11;
    z[2] = (z[2] - z[0] * el.l20 - z[1] * el.l21) * el.inverse_l22;
    const std::size_t row = z_pose_[a];
    schur_rhs_[row] += z[0] * el.y[0] + z[1] * el.y[1] + z[2] * el.y[2];
    for (std::size_t b = 0; b <= a; ++b) {
      Columns6& block = schur_[row * (row + 1) / 2 + z_pose_[b]];
      const Columns3& zb = z_[b];
      for (std::size_t col = 0; col < 6; ++col) block[col] += z[0] * zb[0][col] + z[1] * zb[1][col] + z[2] * zb[2][col];
    }
  }
}

bool SchurSweep::solve(double lambda) {
  lambda_ = lambda;
  std::fill(schur_.begin(), schur_.end(), Columns6{});
  std::fill(schur_rhs_.begin(), schur_rhs_.end(), Lanes{});
  std::fill(pose_normals_.begin(), pose_normals_.end(), PoseNormal{});
  for (std::size_t i = 0; i < points_.size(); ++i) eliminate_point(i, lambda);
  return solve_reduced(lambda);
}

bool SchurSweep::solve_reduced(double lambda) {
  predicted_gain_ = 0;
  if (free_poses_.empty()) return true;
  for (std::size_t j = 0; j < free_poses_.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(6 * j);
    Matrix6 h = unpack_pose_normal(pose_normals_[j].h);
    // A pose without active edges stays where it is.
    for (int d = 0; d < 6; ++d) h(d, d) = h(d, d) > 0 ? h(d, d) * (1 + lambda) : 1.0;
    for (std::size_t k = 0; k <= j; ++k) {
      const Columns6& block = schur_[j * (j + 1) / 2 + k];
      for (Eigen::Index c = 0; c < 6; ++c)
        for (Eigen::Index r = 0; r < 6; ++r)
          reduced_(row + r, static_cast<Eigen::Index>(6 * k) + c) = -block[static_cast<std::size_t>(c)][r];
    }
    reduced_.block<6, 6>(row, row) += h;
    for (int d = 0; d < 6; ++d) reduced_rhs_[row + d] = pose_normals_[j].g[d] - schur_rhs_[j][d];
  }
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> solver(reduced_);
  if (solver.info() != Eigen::Success) return false;
  pose_step_ = solver.solve(reduced_rhs_);
  if (!pose_step_.allFinite()) return false;
  for (std::size_t j = 0; j < free_poses_.size(); ++j) {
    const Vector6 step = pose_step_.segment<6>(static_cast<Eigen::Index>(6 * j));
    const PoseNormal& pn = pose_normals_[j];
    predicted_gain_ += step.dot(Eigen::Map<const Vector6>(pn.g));
    predicted_gain_ += lambda * unpack_pose_normal(pn.h).diagonal().dot(step.cwiseProduct(step));
  }
  return true;
}

Eigen::Vector3d SchurSweep::substitute_back(std::size_t point) const {
  const Eliminated& el = eliminated_[point];
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (std::uint32_t k = edge_begin_[point]; k < edge_begin_[point + 1]; ++k) {
    const Edge& e = edges_[k];
    const Coupling& c = couplings_[k];
    if (e.free < 0 || !(e.pixel_weight > 0) || !(c.p.z() > kMinDepthM)) continue;
    const Vector6 step = pose_step_.segment<6>(6 * e.free);
    rhs.noalias() += c.n.transpose() * (step.head<3>() + step.tail<3>().cross(c.p));
  }
  // y - L^-1 (W^T step), then L^-T.
  Eigen::Vector3d s;
  s[0] = rhs[0] * el.inverse_l00;
  s[1] = (rhs[1] - el.l10 * s[0]) * el.inverse_l11;
  s[2] = (rhs[2] - el.l20 * s[0] - el.l21 * s[1]) * el.inverse_l22;
  s = el.y - s;
  Eigen::Vector3d x;
  x[2] = s[2] * el.inverse_l22;
  x[1] = (s[1] - el.l21 * x[2]) * el.inverse_l11;
  x[0] = (s[0] - el.l10 * x[1] - el.l20 * x[2]) * el.inverse_l00;
  return x;
}

double SchurSweep::try_step() {
  for (std::size_t j = 0; j < free_poses_.size(); ++j) {
    const std::uint32_t i = free_poses_[j];
    candidate_poses_[i] = SE3::exp(pose_step_.segment<6>(static_cast<Eigen::Index>(6 * j))) * poses_[i];
    candidate_matrices_[i] = PoseMatrix(candidate_poses_[i]);
  }
  double sum = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    candidate_points_[i] = points_[i];
    const Eliminated& el = eliminated_[i];
    if (el.moves) {
      const Eigen::Vector3d step = substitute_back(i);
      candidate_points_[i] += step;
      predicted_gain_ += step.dot(el.g + lambda_ * el.diagonal.cwiseProduct(step));
    }
    for (std::uint32_t k = edge_begin_[i]; k < edge_begin_[i + 1]; ++k) {
      const Edge& e = edges_[k];
      if (!(e.pixel_weight > 0)) continue;
      sum += edge_cost(e, candidate_matrices_[e.pose].r * candidate_points_[i] + candidate_matrices_[e.pose].t);
    }
  }
  return sum;
}

void SchurSweep::accept_step() {
  poses_.swap(candidate_poses_);
  matrices_.swap(candidate_matrices_);
  points_.swap(candidate_points_);
}

void SchurSweep::classify() {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (std::uint32_t k = edge_begin_[i]; k < edge_begin_[i + 1]; ++k) {
      Edge& e = edges_[k];
      e.pixel_weight = e.disparity_weight = 0;
      const Eigen::Vector3d p = matrices_[e.pose].r * points_[i] + matrices_[e.pose].t;
      if (!(e.pixel_variance_inverse > 0) || !(p.z() > kMinDepthM)) continue;
      const ResidualTerms<double> r = residual_terms(camera_, p.x(), p.y(), p.z(), e.u, e.v, e.disparity);
      if (!(e.pixel_variance_inverse * (r.u * r.u + r.v * r.v) <= pixel_limit_)) continue;
      e.pixel_weight = e.pixel_variance_inverse;
      if (e.disparity_variance_inverse * r.disparity * r.disparity <= disparity_limit_)
        e.disparity_weight = e.disparity_variance_inverse;
    }
  }
}

void SchurSweep::leave_out_outliers() {
  classify();
  switch_off_weak_points();
}

bool SchurSweep::write_back(BaProblem& problem) const {
  for (const std::uint32_t i : free_poses_)
    if (!poses_[i].is_finite()) return false;
  for (const std::uint32_t i : free_poses_) problem.poses[i] = poses_[i];
  problem.points = points_;
  return true;
}

int SchurSweep::write_inliers(std::vector<std::uint8_t>& edge_inlier) const {
  edge_inlier.assign(edges_.size(), 0);
  int outliers = 0;
  for (const Edge& e : edges_) {
    edge_inlier[e.original] = e.pixel_weight > 0;
    outliers += !(e.pixel_weight > 0);
  }
  return outliers;
}

}  // namespace semvslam
