#include "semvslam/geometry/se3_jacobian.h"

#include <gtest/gtest.h>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

using Tangent = SE3::Tangent;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

class Se3Jacobian : public testing::TestWithParam<double> {
 protected:
  Se3Jacobian() {
    Random random(6, "jacobian");
    for (int i = 0; i < 6; ++i) xi_[i] = random.uniform(-2, 2);
    xi_.tail<3>() = xi_.tail<3>().normalized() * GetParam();
  }
  Tangent xi_;
};

TEST_P(Se3Jacobian, LeftIsTheDerivativeOfExp) {
  const Matrix6 j = left_jacobian(xi_);
  const double h = 1e-5;
  for (int i = 0; i < 6; ++i) {
    const Tangent d = Tangent::Unit(i) * h;
    const Tangent numeric =
        ((SE3::exp(xi_ + d) * SE3::exp(xi_).inverse()).log() - (SE3::exp(xi_ - d) * SE3::exp(xi_).inverse()).log()) /
        (2 * h);
    EXPECT_LT((numeric - j.col(i)).norm(), 1e-8) << i;
  }
  EXPECT_LT((j * left_jacobian_inverse(xi_) - Matrix6::Identity()).norm(), 1e-12);
}

TEST_P(Se3Jacobian, RightInverseIsTheDerivativeOfLog) {
  const Matrix6 j = right_jacobian_inverse(xi_);
  const double h = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const Tangent d = Tangent::Unit(i) * h;
    const Tangent numeric = ((SE3::exp(xi_) * SE3::exp(d)).log() - (SE3::exp(xi_) * SE3::exp(-d)).log()) / (2 * h);
    EXPECT_LT((numeric - j.col(i)).norm(), 1e-6) << i;
  }
}

TEST_P(Se3Jacobian, AdjointMovesTangentsThroughAPose) {
  const SE3 pose(Eigen::Quaterniond(0.3, 0.5, -0.6, 0.1), Eigen::Vector3d(1, -2, 3));
  const SE3 a = pose * SE3::exp(xi_) * pose.inverse(), b = SE3::exp(adjoint(pose) * xi_);
  EXPECT_LT((a * b.inverse()).log().norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Angles, Se3Jacobian, testing::Values(0.0, 1e-7, 1e-3, 0.049, 0.051, 0.7, 2.0, 3.0));

}  // namespace
}  // namespace semvslam
