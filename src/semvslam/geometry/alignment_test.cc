#include "semvslam/geometry/alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace semvslam {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points random_points(int n, std::uint32_t seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(-3, 3);
  Points out(static_cast<std::size_t>(n));
  for (auto& p : out) p = {u(rng), u(rng), u(rng)};
  return out;
}

const SE3 kTruth(Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2), Eigen::Vector3d(1.5, -20, 3));

TEST(Alignment, RecoversRigidMotionExactly) {
  const Points b = random_points(20, 1);
  Points a;
  for (const auto& p : b) a.push_back(kTruth * p);
  const auto result = align_points(a, b, false);
  ASSERT_TRUE(result.ok());
  EXPECT_LT((result->a_from_b.rigid * kTruth.inverse()).log().norm(), 1e-12);
  EXPECT_EQ(result->a_from_b.scale, 1.0);
  EXPECT_LT(result->rmse_m, 1e-12);
}

TEST(Alignment, RecoversScaleOnlyWhenAsked) {
  const Points b = random_points(50, 2);
  const Sim3 truth{2.5, kTruth};
  Points a;
  for (const auto& p : b) a.push_back(truth * p);
  const auto with = align_points(a, b, true);
  ASSERT_TRUE(with.ok());
  EXPECT_NEAR(with->a_from_b.scale, 2.5, 1e-12);
  EXPECT_LT((with->a_from_b.rigid.translation() - kTruth.translation()).norm(), 1e-11);
  EXPECT_LT(with->rmse_m, 1e-12);
  const auto without = align_points(a, b, false);
  ASSERT_TRUE(without.ok());
  EXPECT_GT(without->rmse_m, 1.0);
}

TEST(Alignment, IsTheMinimumUnderNoise) {
  const Points b = random_points(100, 3);
  std::mt19937 rng(4);
  std::normal_distribution<double> noise(0, 0.05);
  Points a;
  for (const auto& p : b) a.push_back(kTruth * p + Eigen::Vector3d(noise(rng), noise(rng), noise(rng)));
  const auto best = align_points(a, b, true);
  ASSERT_TRUE(best.ok());
  for (int axis = 0; axis < 7; ++axis) {
    for (const double step : {-1e-3, 1e-3}) {
      Sim3 other = best->a_from_b;
      if (axis == 6) {
        other.scale *= 1 + step;
      } else {
        SE3::Tangent xi = SE3::Tangent::Zero();
        xi[axis] = step;
        other.rigid = SE3::exp(xi) * other.rigid;
      }
      double squared = 0;
      for (std::size_t i = 0; i < a.size(); ++i) squared += (a[i] - other * b[i]).squaredNorm();
      EXPECT_GT(std::sqrt(squared / 100), best->rmse_m) << "axis " << axis << " step " << step;
    }
  }
}

TEST(Alignment, NeverReturnsAReflection) {
  const Points b = random_points(10, 5);
  Points a;
  for (const auto& p : b) a.push_back({p.x(), p.y(), -p.z()});
  const auto result = align_points(a, b, false);
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->a_from_b.rigid.rotation_matrix().determinant(), 1.0, 1e-12);
  EXPECT_GT(result->rmse_m, 0.1);
}

TEST(Alignment, PlanarPointsAreEnough) {
  Points b = random_points(10, 6);
  for (auto& p : b) p.z() = 0;
  Points a;
  for (const auto& p : b) a.push_back(kTruth * p);
  const auto result = align_points(a, b, false);
  ASSERT_TRUE(result.ok());
  EXPECT_LT((result->a_from_b.rigid * kTruth.inverse()).log().norm(), 1e-10);
}

TEST(Alignment, RefusesWhatHasNoAnswer) {
  const Points three = random_points(3, 7);
  EXPECT_FALSE(
      align_points(Points(three.begin(), three.begin() + 2), Points(three.begin(), three.begin() + 2), false).ok());
  EXPECT_FALSE(align_points(three, random_points(4, 8), false).ok());
  EXPECT_FALSE(align_points(Points(5, three[0]), Points(5, three[0]), false).ok());
  Points line;
  for (int i = 0; i < 9; ++i) line.push_back(Eigen::Vector3d(1, 2, 3) * i);
  EXPECT_FALSE(align_points(line, line, false).ok());
  Points bad = three;
  bad[1].y() = std::numeric_limits<double>::quiet_NaN();
  const auto result = align_points(three, bad, false);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("pair 1"), std::string::npos);
}

}  // namespace
}  // namespace semvslam
