#include "semvslam/semantic/low_rank.h"

#include <Eigen/Eigenvalues>

namespace semvslam {

std::optional<LowRank> factor(const Eigen::Ref<const RowMajorMatrix>& matrix, double energy) {
  if (matrix.rows() == 0 || matrix.rows() > matrix.cols()) return std::nullopt;
  // The left singular vectors are the eigenvectors of this small square: far cheaper than a decomposition of the whole.
  const Eigen::MatrixXf square = matrix * matrix.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> solver(square);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Eigen::VectorXd squares = solver.eigenvalues().cast<double>().cwiseMax(0);  // ascending
  double left = energy * squares.sum();
  Eigen::Index rank = 0;
  while (rank < squares.size() && left > 0) left -= squares[squares.size() - ++rank];
  if (rank == 0 || 2 * rank * (matrix.rows() + matrix.cols()) > matrix.rows() * matrix.cols()) return std::nullopt;
  LowRank out;
  out.high = solver.eigenvectors().rightCols(rank);
  out.wide = out.high.transpose() * matrix;
  return out;
}

}  // namespace semvslam
