#pragma once

#include <Eigen/Core>
#include <optional>

namespace semvslam {

using RowMajorMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A matrix as the product of a high and a wide one.
struct LowRank {
  RowMajorMatrix high, wide;  // rows x rank, rank x columns
};

/// The product of least rank that keeps this share of the matrix's sum of squares, by its singular vectors: what
/// R. Girshick (Fast R-CNN, ICCV 2015, section 3.1) does to fully connected layers. Nothing where multiplying by the
/// two would not take half the operations or less. @param matrix no higher than wide, finite. @param energy (0, 1].
std::optional<LowRank> factor(const Eigen::Ref<const RowMajorMatrix>& matrix, double energy);

}  // namespace semvslam
