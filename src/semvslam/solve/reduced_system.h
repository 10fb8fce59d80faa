#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "semvslam/solve/lanes.h"

namespace semvslam {

/// The symmetric system over the free poses that is left when the points are eliminated: 6x6 blocks for the pairs of
/// poses that see a point together. Solved by a dense Cholesky factorisation when the blocks are few or most are there,
/// by a sparse one (AMD ordering) otherwise.
class ReducedSystem {
 public:
  using Columns6 = std::array<Lanes, 6>;  // columns of a 6x6 block, two rows of padding

  /// @param poses number of free poses. Afterwards mark() every pair, then finish().
  explicit ReducedSystem(std::size_t poses);
  void mark(std::size_t row, std::size_t column) { index_[row * poses_ + column] = 0; }  // row >= column
  void finish();

  void set_zero();
  Columns6& block(std::size_t row, std::size_t column) { return blocks_[index_[row * poses_ + column]]; }
  /// Rows 0..5 are used.
  Lanes& rhs(std::size_t row) { return rhs_[row]; }

  /// Solves A x = rhs from the lower triangle of A. @return false when A is not positive definite.
  bool solve();
  const Eigen::VectorXd& solution() const { return solution_; }

 private:
  static constexpr std::uint32_t kAbsent = 0xffffffffu;
  bool solve_dense();
  bool solve_sparse();

  std::size_t poses_;
  bool dense_ = true;
  std::vector<std::uint32_t> index_;                            // of the pair's block, or kAbsent
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;  // (row, column) of each block, column by column
  std::vector<Columns6> blocks_;
  std::vector<Lanes> rhs_;
  Eigen::MatrixXd matrix_;
  Eigen::SparseMatrix<double> sparse_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> sparse_solver_;
  Eigen::VectorXd vector_, solution_;
};

}  // namespace semvslam
