#include "semvslam/solve/reduced_system.h"

#include <algorithm>

namespace semvslam {
namespace {

constexpr std::size_t kAlwaysDensePoses = 64;
constexpr double kDenseShare = 0.4;  // of the blocks; sparse factors of fuller matrices fill up anyway

}  // namespace

ReducedSystem::ReducedSystem(std::size_t poses) : poses_(poses), index_(poses * poses, kAbsent) {
  for (std::size_t i = 0; i < poses; ++i) mark(i, i);
}

void ReducedSystem::finish() {
  pairs_.clear();
  for (std::size_t column = 0; column < poses_; ++column) {
    for (std::size_t row = column; row < poses_; ++row) {
      std::uint32_t& index = index_[row * poses_ + column];
      if (index == kAbsent) continue;
      index = static_cast<std::uint32_t>(pairs_.size());
      pairs_.emplace_back(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(column));
    }
  }
  blocks_.resize(pairs_.size());
  rhs_.resize(poses_);
  const auto n = static_cast<Eigen::Index>(6 * poses_);
  vector_.resize(n);
  solution_.resize(n);
  const double share = static_cast<double>(pairs_.size()) / (0.5 * static_cast<double>(poses_ * (poses_ + 1)));
  dense_ = poses_ <= kAlwaysDensePoses || share > kDenseShare;
  if (dense_) {
    matrix_.setZero(n, n);
    return;
  }
  std::vector<Eigen::Triplet<double>> pattern;
  pattern.reserve(36 * pairs_.size());
  for (const auto& [row, column] : pairs_)
    for (int c = 0; c < 6; ++c)
      for (int r = 0; r < 6; ++r)
        pattern.emplace_back(static_cast<int>(6 * row) + r, static_cast<int>(6 * column) + c, 1.0);
  sparse_.resize(n, n);
  sparse_.setFromTriplets(pattern.begin(), pattern.end());
  sparse_solver_.analyzePattern(sparse_);
}

void ReducedSystem::set_zero() {
  std::fill(blocks_.begin(), blocks_.end(), Columns6{});
  std::fill(rhs_.begin(), rhs_.end(), Lanes{});
}

bool ReducedSystem::solve() {
  for (std::size_t i = 0; i < poses_; ++i)
    for (int k = 0; k < 6; ++k) vector_[static_cast<Eigen::Index>(6 * i) + k] = rhs_[i][k];
  return (dense_ ? solve_dense() : solve_sparse()) && solution_.allFinite();
}

bool ReducedSystem::solve_dense() {
  // The factorisation leaves its result in the matrix: pairs without a block must be made zero again.
  if (pairs_.size() < poses_ * (poses_ + 1) / 2) matrix_.setZero();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Eigen::Index row = 6 * static_cast<Eigen::Index>(pairs_[i].first);
    const Eigen::Index column = 6 * static_cast<Eigen::Index>(pairs_[i].second);
    for (Eigen::Index c = 0; c < 6; ++c)
      for (Eigen::Index r = 0; r < 6; ++r) matrix_(row + r, column + c) = blocks_[i][static_cast<std::size_t>(c)][r];
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> solver(matrix_);
  if (solver.info() != Eigen::Success) return false;
  solution_ = vector_;
  solver.solveInPlace(solution_);
  return true;
}

bool ReducedSystem::solve_sparse() {
  // Blocks are stored column by column, as the sparse matrix is: a column's values follow each other.
  double* values = sparse_.valuePtr();
  for (std::size_t begin = 0; begin < pairs_.size();) {
    std::size_t end = begin;
    while (end < pairs_.size() && pairs_[end].second == pairs_[begin].second) ++end;
    for (std::size_t c = 0; c < 6; ++c)
      for (std::size_t i = begin; i < end; ++i)
        for (int r = 0; r < 6; ++r) *values++ = blocks_[i][c][r];
    begin = end;
  }
  sparse_solver_.factorize(sparse_);
  if (sparse_solver_.info() != Eigen::Success) return false;
  solution_ = sparse_solver_.solve(vector_);
  return true;
}

}  // namespace semvslam
