#include "semvslam/solve/residuals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "semvslam/solve/lanes.h"
#include "semvslam/solve/synthetic_test_scenes.h"

namespace semvslam {
namespace {

using Vector6 = SE3::Tangent;
const SE3 kPose(Eigen::Quaterniond(0.9, 0.1, -0.2, 0.3), Eigen::Vector3d(0.3, -0.2, 0.5));

PointObservation observation(double u, double v, double disparity) {
  PointObservation o;
  o.pixel = {u, v};
  o.disparity_px = disparity;
  return o;
}

// Derivatives against central differences, at points from next to the image plane to very far away.
class ResidualDerivative : public testing::TestWithParam<Eigen::Vector3d> {
 protected:
  const Intrinsics camera_ = Intrinsics::of(synthetic::vga_camera());
  const Eigen::Vector3d in_camera_ = GetParam();
  const Eigen::Vector3d point_ = kPose.inverse() * in_camera_;
  const PointObservation observation_ = observation(300, 200, 12);
  const double step_ = 1e-6 * std::min(1.0, in_camera_.z());
};

TEST_P(ResidualDerivative, ByPoseMatchesNumericOne) {
  const DenseResidual r = dense_residual(camera_, kPose, point_, observation_);
  ASSERT_TRUE(r.valid);
  for (int i = 0; i < 6; ++i) {
    const Vector6 d = Vector6::Unit(i) * step_;
    const Eigen::Vector3d plus = dense_residual(camera_, SE3::exp(d) * kPose, point_, observation_).value;
    const Eigen::Vector3d minus = dense_residual(camera_, SE3::exp(-d) * kPose, point_, observation_).value;
    const Eigen::Vector3d numeric = (plus - minus) / (2 * step_);
    EXPECT_LT((numeric - r.by_pose.col(i)).norm(), 1e-5 * (1 + r.by_pose.norm())) << "direction " << i;
  }
}

TEST_P(ResidualDerivative, ByPointMatchesNumericOne) {
  const DenseResidual r = dense_residual(camera_, kPose, point_, observation_);
  ASSERT_TRUE(r.valid);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = Eigen::Vector3d::Unit(i) * step_;
    const Eigen::Vector3d numeric = (dense_residual(camera_, kPose, point_ + d, observation_).value -
                                     dense_residual(camera_, kPose, point_ - d, observation_).value) /
                                    (2 * step_);
    EXPECT_LT((numeric - r.by_point.col(i)).norm(), 1e-5 * (1 + r.by_point.norm())) << "axis " << i;
  }
}

TEST_P(ResidualDerivative, NormalEquationsAreThoseOfTheJacobian) {
  const DenseResidual r = dense_residual(camera_, kPose, point_, observation_);
  const Eigen::Vector3d weights(0.7, 0.7, 1.9);
  const ResidualTerms<double> t =
      residual_terms(camera_, in_camera_.x(), in_camera_.y(), in_camera_.z(), 300.0, 200.0, 12.0);
  double h[kPoseEntries] = {}, g[6] = {};
  add_pose_normal(point_information(t, 0.7, 1.9), in_camera_.x(), in_camera_.y(), in_camera_.z(), h, g);
  const Eigen::Matrix<double, 6, 6> expected = r.by_pose.transpose() * weights.asDiagonal() * r.by_pose;
  EXPECT_LT((unpack_pose_normal(h) - expected).norm(), 1e-9 * expected.norm());
  const Vector6 gradient = -r.by_pose.transpose() * weights.asDiagonal() * r.value;
  EXPECT_LT((Eigen::Map<const Vector6>(g) - gradient).norm(), 1e-9 * gradient.norm());
}

TEST_P(ResidualDerivative, LanesComputeWhatOneDoubleDoes) {
  Lanes x = broadcast(in_camera_.x()), y = broadcast(in_camera_.y()), z = broadcast(in_camera_.z());
  for (int i = 0; i < kLanes; ++i) x[i] += 0.01 * i;
  const ResidualTerms<Lanes> t = residual_terms<Lanes>(camera_, x, y, z, broadcast(300), broadcast(200), broadcast(12));
  Lanes h[kPoseEntries] = {}, g[6] = {};
  add_pose_normal(point_information<Lanes>(t, broadcast(0.7), broadcast(1.9)), x, y, z, h, g);
  for (int i = 0; i < kLanes; ++i) {
    const ResidualTerms<double> s = residual_terms(camera_, x[i], y[i], z[i], 300.0, 200.0, 12.0);
    double hs[kPoseEntries] = {}, gs[6] = {};
    add_pose_normal(point_information(s, 0.7, 1.9), x[i], y[i], z[i], hs, gs);
    for (int k = 0; k < kPoseEntries; ++k) EXPECT_DOUBLE_EQ(h[k][i], hs[k]);
    for (int k = 0; k < 6; ++k) EXPECT_DOUBLE_EQ(g[k][i], gs[k]);
  }
}

INSTANTIATE_TEST_SUITE_P(Points, ResidualDerivative,
                         testing::Values(Eigen::Vector3d(0.3, -0.4, 2), Eigen::Vector3d(0, 0, 1),
                                         Eigen::Vector3d(0.001, 0.002, 0.0015),  // next to the image plane
                                         Eigen::Vector3d(1, -1, 0.01), Eigen::Vector3d(50, 20, 400),
                                         Eigen::Vector3d(-2000, 1000, 1e4)));

TEST(Residuals, NothingBehindTheCamera) {
  const Intrinsics camera = Intrinsics::of(synthetic::vga_camera());
  for (const double z : {0.0, -1.0, kMinDepthM, synthetic::kNan}) {
    const DenseResidual r = dense_residual(camera, SE3(), {0.1, 0.1, z}, observation(1, 1, 1));
    EXPECT_FALSE(r.valid) << z;
    EXPECT_EQ(r.by_pose.norm(), 0);
  }
}

TEST(Residuals, WithoutDepthTheDisparityRowIsZero) {
  const Intrinsics camera = Intrinsics::of(synthetic::vga_camera());
  for (const double disparity : {-1.0, 0.0, synthetic::kNan}) {
    const DenseResidual r =
        dense_residual(camera, kPose, kPose.inverse() * Eigen::Vector3d(0, 0, 2), observation(1, 1, disparity));
    ASSERT_TRUE(r.valid);
    EXPECT_EQ(r.value.z(), 0);
    EXPECT_EQ(r.by_pose.row(2).norm(), 0);
    EXPECT_EQ(r.by_point.row(2).norm(), 0);
  }
}

TEST(Residuals, HuberIsSmoothAtTheCornerAndItsWeightIsTheDerivative) {
  const double limit = 5.991;
  EXPECT_EQ(huber_cost(3.0, limit), 3.0);
  EXPECT_NEAR(huber_cost(limit * (1 + 1e-9), limit), limit, 1e-7);
  for (const double s : {0.1, 5.9, 6.1, 100.0, 1e6}) {
    const double d = 1e-5 * s;
    EXPECT_NEAR((huber_cost(s + d, limit) - huber_cost(s - d, limit)) / (2 * d), huber_weight(s, limit), 1e-6) << s;
  }
}

TEST(Residuals, RecognisesUsableObservations) {
  EXPECT_TRUE(is_usable(observation(1, 2, -1)));
  EXPECT_FALSE(is_usable(observation(synthetic::kNan, 2, 1)));
  EXPECT_FALSE(has_depth(observation(1, 2, synthetic::kNan)));
  EXPECT_FALSE(has_depth(observation(1, 2, 0)));
  PointObservation o = observation(1, 2, 3);
  EXPECT_TRUE(has_depth(o));
  o.inverse_variance_disparity = 0;
  EXPECT_FALSE(has_depth(o));
  o.inverse_variance_px = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(is_usable(o));
  EXPECT_FALSE(is_usable(observation(1e200, 0, 1)));
  EXPECT_FALSE(has_depth(observation(1, 2, 1e200)));
  EXPECT_TRUE(is_usable(Eigen::Vector3d(1, -1e6, 3)));
  EXPECT_FALSE(is_usable(Eigen::Vector3d(1, -1e200, 3)));
  EXPECT_FALSE(is_usable(Eigen::Vector3d(1, synthetic::kNan, 3)));
}

}  // namespace
}  // namespace semvslam
