#include "semvslam/semantic/low_rank.h"

#include <gtest/gtest.h>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

RowMajorMatrix random_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Random random(seed);
  RowMajorMatrix out(rows, columns);
  for (Eigen::Index i = 0; i < out.size(); ++i) out.data()[i] = static_cast<float>(random.uniform(-1, 1));
  return out;
}

TEST(LowRank, AProductOfLowRankIsFoundAgain) {
  const RowMajorMatrix matrix = random_matrix(40, 5, 1) * random_matrix(5, 300, 2);
  const auto found = factor(matrix, 1 - 1e-5);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->high.cols(), 5);
  EXPECT_EQ(found->wide.rows(), 5);
  EXPECT_LT((found->high * found->wide - matrix).norm(), 1e-2 * matrix.norm());
}

TEST(LowRank, TheShareAskedForIsKeptByTheLeastRank) {
  // Singular values that are known: 20 rows at right angles to each other, each shorter than the one before.
  RowMajorMatrix matrix = RowMajorMatrix::Zero(20, 400);
  for (Eigen::Index k = 0; k < 20; ++k) matrix(k, 3 * k) = std::pow(0.5f, static_cast<float>(k));
  const auto found = factor(matrix, 0.99);  // 1 - 0.25^rank, as good as
  ASSERT_TRUE(found);
  EXPECT_EQ(found->high.cols(), 4);
  EXPECT_NEAR((found->high * found->wide).squaredNorm() / matrix.squaredNorm(), 1 - std::pow(0.25, 4), 1e-5);
}

TEST(LowRank, WhatWouldSaveTooLittleStaysWhole) {
  EXPECT_FALSE(factor(random_matrix(40, 300, 3), 0.95));   // noise has no small rank
  EXPECT_FALSE(factor(random_matrix(300, 40, 3), 0.5));    // higher than wide
  EXPECT_FALSE(factor(RowMajorMatrix::Zero(4, 40), 0.9));  // nothing in it
}

}  // namespace
}  // namespace semvslam
