#include "semvslam/solve/reduced_system.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "semvslam/base/random.h"
#include "semvslam/solve/bundle_adjustment.h"
#include "semvslam/solve/synthetic_test_scenes.h"

namespace semvslam {
namespace {

// Neighbours in a chain share points, and the first and last pose do: sparse beyond 64 poses, dense below.
class ReducedSystemTest : public testing::TestWithParam<std::size_t> {};

TEST_P(ReducedSystemTest, SolvesWhatAPlainMatrixDoes) {
  const std::size_t n = GetParam();
  ReducedSystem system(n);
  for (std::size_t i = 1; i < n; ++i) system.mark(i, i - 1);
  system.mark(n - 1, 0);
  system.finish();
  const auto size = static_cast<Eigen::Index>(6 * n);
  Random random(3, "reduced");
  for (int repeat = 0; repeat < 2; ++repeat) {  // the second time on used storage
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd b(size);
    system.set_zero();
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = static_cast<Eigen::Index>(6 * i);
      for (int r = 0; r < 6; ++r) b[row + r] = system.rhs(i)[r] = random.uniform(-1, 1);
      for (const std::size_t k : {i, i - 1, std::size_t{0}}) {
        if (k > i || (k == 0 && i != n - 1 && i > 1)) continue;  // 0 - 1 wraps around and is left out
        const auto column = static_cast<Eigen::Index>(6 * k);
        for (int r = 0; r < 6; ++r) {
          for (int c = 0; c < 6; ++c) {
            const double value = i == k ? (r == c ? 20.0 : 0.1 * (r + c)) : random.uniform(-1, 1);
            a(row + r, column + c) = a(column + c, row + r) = value;
            system.block(i, k)[static_cast<std::size_t>(c)][r] = value;
          }
        }
      }
    }
    ASSERT_TRUE(system.solve());
    EXPECT_LT((a * system.solution() - b).norm(), 1e-10);
  }
}

TEST_P(ReducedSystemTest, SaysWhenItIsNotPositiveDefinite) {
  ReducedSystem system(GetParam());
  system.finish();
  system.set_zero();
  EXPECT_FALSE(system.solve());
}

INSTANTIATE_TEST_SUITE_P(Sizes, ReducedSystemTest, testing::Values(2, 12, 64, 65, 100));

// A long chain of key frames takes the sparse way through the whole bundle adjustment.
TEST(ReducedSystem, AdjustsALongChain) {
  synthetic::BundleOptions o;
  o.poses = 90;
  o.fixed = 1;
  o.points = 3000;
  o.neighbours = 6;
  o.pose_error = 0.01;
  o.pixel_noise_px = o.disparity_noise_px = 0;
  synthetic::Bundle b = synthetic::make_bundle(o);
  BaOptions options;
  options.robust_iterations = options.final_iterations = 25;
  options.relative_cost_tolerance = 0;
  std::vector<std::uint8_t> inlier;
  const BaSummary s = adjust_bundle(b.problem, options, inlier);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(s.final_cost, 1e-10 * s.initial_cost);
  for (std::size_t i = 0; i < b.true_poses.size(); ++i)
    EXPECT_LT((b.problem.poses[i] * b.true_poses[i].inverse()).log().norm(), 1e-5) << i;
}

}  // namespace
}  // namespace semvslam
