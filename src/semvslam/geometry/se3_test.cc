#include "semvslam/geometry/se3.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

using Tangent = SE3::Tangent;

Tangent random_tangent(Random& random, double angle_rad) {
  Tangent xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.uniform(-1, 1);
  xi.tail<3>() = xi.tail<3>().normalized() * angle_rad;
  return xi;
}

Eigen::Matrix4d matrix(const SE3& pose) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = pose.rotation_matrix();
  m.topRightCorner<3, 1>() = pose.translation();
  return m;
}

TEST(SE3, FromUnitKeepsEveryBit) {
  Random random(3, "unit");
  for (int i = 0; i < 100; ++i) {
    const SE3 pose = SE3::exp(random_tangent(random, 1.0 + 0.01 * i));
    const SE3 copy = SE3::from_unit(pose.rotation(), pose.translation());
    EXPECT_EQ(copy.rotation().coeffs(), pose.rotation().coeffs());
    EXPECT_EQ(copy.translation(), pose.translation());
  }
}

TEST(Skew, IsTheCrossProduct) {
  const Eigen::Vector3d a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_EQ(skew(a) * b, a.cross(b));
  EXPECT_EQ(skew(a).transpose(), -skew(a));
}

// From no rotation over the switch between series and closed form up to nearly pi.
class Se3ByAngle : public testing::TestWithParam<double> {};

TEST_P(Se3ByAngle, LogUndoesExp) {
  Random random(1, "se3");
  for (int i = 0; i < 50; ++i) {
    const Tangent xi = random_tangent(random, GetParam());
    EXPECT_LT((SE3::exp(xi).log() - xi).norm(), 1e-9) << xi.transpose();
  }
}

TEST_P(Se3ByAngle, ExpIsTheMatrixExponential) {
  Random random(2, "se3");
  const Tangent xi = random_tangent(random, GetParam());
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = skew(xi.tail<3>());
  generator.topRightCorner<3, 1>() = xi.head<3>();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
  for (int k = 1; k < 60; ++k) {
    term = term * generator / k;
    sum += term;
  }
  EXPECT_LT((matrix(SE3::exp(xi)) - sum).norm(), 1e-12);
}

TEST_P(Se3ByAngle, ReportsTheAngle) {
  Random random(3, "se3");
  EXPECT_NEAR(SE3::exp(random_tangent(random, GetParam())).rotation_angle_rad(), GetParam(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Angles, Se3ByAngle,
                         testing::Values(0.0, 1e-12, 1e-6, 0.9e-4, 1.1e-4, 0.01, 1.0, 3.0, std::numbers::pi - 1e-3));

TEST(Se3, GroupLaws) {
  Random random(4, "se3");
  for (int i = 0; i < 50; ++i) {
    const SE3 a = SE3::exp(random_tangent(random, 1)), b = SE3::exp(random_tangent(random, 2)),
              c = SE3::exp(random_tangent(random, 3));
    const Eigen::Vector3d p(1, 2, 3);
    EXPECT_LT(((a * b) * c * p - a * (b * (c * p))).norm(), 1e-12);
    EXPECT_LT((a * a.inverse()).log().norm(), 1e-14);
    EXPECT_LT((matrix(a * b) - matrix(a) * matrix(b)).norm(), 1e-13);
    EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-13);
  }
}

TEST(Se3, RotationStaysAUnitQuaternionOverManyProducts) {
  const SE3 step = SE3::exp((Tangent() << 0.01, 0, 0, 0.001, 0.002, 0.003).finished());
  SE3 pose;
  for (int i = 0; i < 100000; ++i) pose = step * pose;
  EXPECT_NEAR(pose.rotation().norm(), 1, 1e-12);
}

TEST(Se3, SaysWhenItIsNotFinite) {
  EXPECT_TRUE(SE3().is_finite());
  EXPECT_FALSE(SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, std::nan(""), 0)).is_finite());
  EXPECT_FALSE(SE3::exp(Tangent::Constant(std::nan(""))).is_finite());
}

TEST(Sim3, ScalesRotatesAndMoves) {
  const Sim3 s{2.0,
               SE3(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ())), {1, 0, 0})};
  EXPECT_LT((s * Eigen::Vector3d(1, 0, 3) - Eigen::Vector3d(1, 2, 6)).norm(), 1e-15);
}

}  // namespace
}  // namespace semvslam
