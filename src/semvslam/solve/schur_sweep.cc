#include "semvslam/solve/schur_sweep.h"

#include <cmath>
#include <stdexcept>

namespace semvslam {
namespace {

constexpr double kSmallestPointPivot = 1e-14;  // of a point's block, relative to its diagonal

// Position of the diagonal in the packed upper triangles.
constexpr std::array<std::size_t, 6> kPoseDiagonal{0, 6, 11, 15, 18, 20};
constexpr std::array<std::size_t, 3> kPointDiagonal{0, 3, 5};

void check_indices(const BaProblem& problem) {
  if (problem.pose_fixed.size() != problem.poses.size())
    throw std::invalid_argument("adjust_bundle: pose_fixed must have one entry per pose");
  for (const BaProblem::Edge& e : problem.edges)
    if (e.pose >= problem.poses.size() || e.point >= problem.points.size())
      throw std::invalid_argument("adjust_bundle: an edge refers to a pose or point that is not there");
}

}  // namespace

SchurSweep::SchurSweep(const BaProblem& problem, double pixel_limit, double disparity_limit)
    : poses_(problem.poses), points_(problem.points) {
  check_indices(problem);
  bool finite = is_usable(problem.camera), any_fixed = false;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    finite &= poses_[i].is_finite();
    any_fixed |= problem.pose_fixed[i] != 0;
    if (!problem.pose_fixed[i]) free_poses_.push_back(static_cast<std::uint32_t>(i));
    matrices_.emplace_back(poses_[i]);
  }
  edges_.emplace(problem, points_, pixel_limit, disparity_limit);
  usable_ = finite && any_fixed && edges_->any_active();
  if (!usable_) return;
  candidate_poses_ = poses_;
  candidate_matrices_ = matrices_;
  candidate_points_ = points_;
  pose_normals_.resize(free_poses_.size());
  point_normals_.resize(points_.size());
  couplings_.resize(edges_->slots());
  factors_.resize(points_.size());
  pose_steps_.resize(free_poses_.size());
  mark_pairs();
}

void SchurSweep::mark_pairs() {
  reduced_.emplace(free_poses_.size());
  for (std::size_t i = 0; i < points_.size(); ++i)
    for (std::uint32_t a = edges_->slot_begin(i); a < edges_->slot_begin(i + 1); ++a)
      for (std::uint32_t b = edges_->slot_begin(i); b <= a; ++b)
        reduced_->mark(edges_->slot_pose(a), edges_->slot_pose(b));
  reduced_->finish();
}

void SchurSweep::Factor::compute(const PointNormal& normal, double lambda) {
  moves = false;
  y.setZero();
  const double d00 = normal[0] * (1 + lambda), d1 = normal[3] * (1 + lambda), d2 = normal[5] * (1 + lambda);
  if (!(d00 > 0)) return;
  inverse_l00 = 1 / std::sqrt(d00);
  l10 = normal[1] * inverse_l00;
  l20 = normal[2] * inverse_l00;
  const double d11 = d1 - l10 * l10;
  if (!(d11 > kSmallestPointPivot * d1)) return;
  inverse_l11 = 1 / std::sqrt(d11);
  l21 = (normal[4] - l20 * l10) * inverse_l11;
  const double d22 = d2 - l20 * l20 - l21 * l21;
  if (!(d22 > kSmallestPointPivot * d2)) return;
  inverse_l22 = 1 / std::sqrt(d22);
  y[0] = normal[6] * inverse_l00;
  y[1] = (normal[7] - l10 * y[0]) * inverse_l11;
  y[2] = (normal[8] - l20 * y[0] - l21 * y[1]) * inverse_l22;
  moves = true;
}

bool SchurSweep::solve(double lambda) {
  lambda_ = lambda;
  predicted_gain_ = 0;
  edges_->linearize(matrices_, points_, pose_normals_, point_normals_, couplings_);
  reduced_->set_zero();
  for (std::size_t i = 0; i < points_.size(); ++i) eliminate_point(i, lambda);
  add_pose_blocks(lambda);
  if (!reduced_->solve()) return false;
  for (std::size_t j = 0; j < free_poses_.size(); ++j) {
    const PoseNormal& normal = pose_normals_[j];
    for (std::size_t k = 0; k < 6; ++k) {
      const double step = reduced_->solution()[static_cast<Eigen::Index>(6 * j + k)];
      pose_steps_[j][k] = step;
      predicted_gain_ += step * (normal[kPoseEntries + k] + lambda * normal[kPoseDiagonal[k]] * step);
    }
  }
  return true;
}

// Subtracts Z Z^T and Z y of the point from the system of the poses.
void SchurSweep::eliminate_point(std::size_t point, double lambda) {
  Factor& f = factors_[point];
  f.compute(point_normals_[point], lambda);
  if (!f.moves) return;
  const std::uint32_t begin = edges_->slot_begin(point), end = edges_->slot_begin(point + 1);
  for (std::uint32_t a = begin; a < end; ++a) {
    Columns3& z = couplings_[a];
    z[0] = z[0] * f.inverse_l00;
    z[1] = (z[1] - z[0] * f.l10) * f.inverse_l11;
    z[2] = (z[2] - z[0] * f.l20 - z[1] * f.l21) * f.inverse_l22;
    const std::uint32_t row = edges_->slot_pose(a);
    reduced_->rhs(row) -= z[0] * f.y[0] + z[1] * f.y[1] + z[2] * f.y[2];
    for (std::uint32_t b = begin; b <= a; ++b) {
      ReducedSystem::Columns6& block = reduced_->block(row, edges_->slot_pose(b));
      const Columns3& zb = couplings_[b];
      for (std::size_t c = 0; c < 6; ++c) block[c] -= z[0] * zb[0][c] + z[1] * zb[1][c] + z[2] * zb[2][c];
    }
  }
}

void SchurSweep::add_pose_blocks(double lambda) {
  for (std::size_t j = 0; j < free_poses_.size(); ++j) {
    const PoseNormal& normal = pose_normals_[j];
    ReducedSystem::Columns6& block = reduced_->block(j, j);
    std::size_t entry = 0;
    for (std::size_t r = 0; r < 6; ++r) {
      for (std::size_t c = r; c < 6; ++c) block[r][c] += normal[entry++];  // the lower triangle
      const double diagonal = normal[kPoseDiagonal[r]];
      block[r][r] += diagonal > 0 ? lambda * diagonal : 1.0;  // a pose without active edges stays where it is
      reduced_->rhs(j)[r] += normal[kPoseEntries + r];
    }
  }
}

Eigen::Vector3d SchurSweep::substitute_back(std::size_t point) const {
  const Factor& f = factors_[point];
  Columns3 sum{};  // Z^T step, still spread over the lanes
  for (std::uint32_t a = edges_->slot_begin(point); a < edges_->slot_begin(point + 1); ++a) {
    const Lanes& step = pose_steps_[edges_->slot_pose(a)];
    for (std::size_t k = 0; k < 3; ++k) sum[k] += couplings_[a][k] * step;
  }
  const Eigen::Vector3d s = f.y - Eigen::Vector3d(sum_lanes(sum[0]), sum_lanes(sum[1]), sum_lanes(sum[2]));
  Eigen::Vector3d x;
  x[2] = s[2] * f.inverse_l22;
  x[1] = (s[1] - f.l21 * x[2]) * f.inverse_l11;
  x[0] = (s[0] - f.l10 * x[1] - f.l20 * x[2]) * f.inverse_l00;
  return x;
}

double SchurSweep::try_step() {
  for (std::size_t j = 0; j < free_poses_.size(); ++j) {
    const std::uint32_t i = free_poses_[j];
    SE3::Tangent step;
    for (int k = 0; k < 6; ++k) step[k] = pose_steps_[j][k];
    candidate_poses_[i] = SE3::exp(step) * poses_[i];
    candidate_matrices_[i] = PoseMatrix(candidate_poses_[i]);
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    candidate_points_[i] = points_[i];
    if (!factors_[i].moves) continue;
    const Eigen::Vector3d step = substitute_back(i);
    candidate_points_[i] += step;
    for (std::size_t k = 0; k < 3; ++k) {
      const double s = step[static_cast<Eigen::Index>(k)];
      predicted_gain_ += s * (point_normals_[i][6 + k] + lambda_ * point_normals_[i][kPointDiagonal[k]] * s);
    }
  }
  return edges_->cost(candidate_matrices_, candidate_points_);
}

void SchurSweep::accept_step() {
  poses_.swap(candidate_poses_);
  matrices_.swap(candidate_matrices_);
  points_.swap(candidate_points_);
}

void SchurSweep::leave_out_outliers() {
  classify();
  edges_->switch_off_weak_points();
}

bool SchurSweep::write_back(BaProblem& problem) const {
  for (const std::uint32_t i : free_poses_)
    if (!poses_[i].is_finite()) return false;
  for (const std::uint32_t i : free_poses_) problem.poses[i] = poses_[i];
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (is_usable(problem.points[i])) problem.points[i] = points_[i];
  return true;
}

}  // namespace semvslam
