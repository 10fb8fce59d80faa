#include "semvslam/solve/pose_optimizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "semvslam/solve/residuals.h"
#include "semvslam/solve/synthetic_test_scenes.h"

namespace semvslam {
namespace {

struct Case {
  synthetic::View view;
  SE3 initial;
  std::vector<std::uint8_t> inlier;
  PoseEstimate run(const PoseOptimizerOptions& options = {}) {
    return optimize_pose(Intrinsics::of(synthetic::vga_camera()), initial, view.points, view.observations, options,
                         inlier);
  }
};

Case make(const synthetic::BundleOptions& o, double shift = 0.05) {
  Case s{synthetic::make_view(o), {}, {}};
  SE3::Tangent d;
  d << shift, -shift, 0.5 * shift, 0.6 * shift, -0.4 * shift, shift;
  s.initial = SE3::exp(d) * s.view.truth;
  return s;
}

TEST(PoseOptimizer, ExactDataGiveTheExactPose) {
  synthetic::BundleOptions o;
  o.points = 300;
  o.pixel_noise_px = o.disparity_noise_px = 0;
  Case s = make(o);
  const PoseEstimate e = s.run();
  EXPECT_LT(synthetic::pose_error(e.camera_from_world, s.view.truth), 1e-8);
  EXPECT_EQ(e.inliers, static_cast<int>(s.view.points.size()));
}

TEST(PoseOptimizer, ErrorUnderNoiseAgreesWithItsCovariance) {
  synthetic::BundleOptions o;
  o.points = 300;
  double squared = 0;
  const int runs = 40;
  for (int k = 0; k < runs; ++k) {
    o.seed = static_cast<std::uint32_t>(100 + k);
    Case s = make(o);
    const PoseEstimate e = s.run();
    const SE3::Tangent d = (s.view.truth * e.camera_from_world.inverse()).log();
    squared += d.dot(e.information * d) / runs;  // chi^2 with 6 degrees of freedom
    EXPECT_NEAR(e.mean_squared_error, 2.0, 0.7);
  }
  EXPECT_GT(squared, 4.0);
  EXPECT_LT(squared, 9.0);
}

TEST(PoseOptimizer, FindsAThirdOfOutliersAndKeepsPixelsWithWrongDepth) {
  synthetic::BundleOptions o;
  o.points = 500;
  o.outlier_share = 0.33;
  o.depth_outlier_share = 0.3;
  Case s = make(o, 0.03);
  const PoseEstimate e = s.run();
  EXPECT_LT(synthetic::pose_error(e.camera_from_world, s.view.truth), 0.003);
  int wrong = 0, wrong_depth = 0, kept_pixels = 0;
  for (std::size_t i = 0; i < s.inlier.size(); ++i) {
    wrong += s.inlier[i] && s.view.is_outlier[i];
    wrong_depth += s.view.is_depth_outlier[i] && !s.view.is_outlier[i];
    kept_pixels += s.view.is_depth_outlier[i] && !s.view.is_outlier[i] && s.inlier[i];
  }
  EXPECT_EQ(wrong, 0);
  ASSERT_GT(wrong_depth, 50);
  EXPECT_GT(kept_pixels, 0.9 * wrong_depth);
  EXPECT_EQ(e.inliers, std::count(s.inlier.begin(), s.inlier.end(), 1));
}

TEST(PoseOptimizer, IsTheMinimumOfItsInliers) {
  synthetic::BundleOptions o;
  o.points = 200;
  o.outlier_share = 0.1;
  Case s = make(o);
  const PoseEstimate e = s.run();
  const Intrinsics camera = Intrinsics::of(synthetic::vga_camera());
  // The gradient by central differences of an independent evaluation of the cost.
  const auto cost = [&](const SE3& pose) {
    double sum = 0;
    for (std::size_t i = 0; i < s.inlier.size(); ++i) {
      if (!s.inlier[i]) continue;
      const PointObservation& ob = s.view.observations[i];
      const DenseResidual r = dense_residual(camera, pose, s.view.points[i], ob);
      const DenseResidual at = dense_residual(camera, e.camera_from_world, s.view.points[i], ob);
      sum += huber_cost(ob.inverse_variance_px * r.value.head<2>().squaredNorm(), 5.991);
      if (ob.inverse_variance_disparity * at.value.z() * at.value.z() <= 3.841)
        sum += huber_cost(ob.inverse_variance_disparity * r.value.z() * r.value.z(), 3.841);
    }
    return sum;
  };
  for (int i = 0; i < 6; ++i) {
    const SE3::Tangent d = SE3::Tangent::Unit(i) * 1e-5;
    const double slope = (cost(SE3::exp(d) * e.camera_from_world) - cost(SE3::exp(-d) * e.camera_from_world)) / 2e-5;
    // A step of slope / curvature would bring the minimum: it must be far below the standard deviation.
    EXPECT_LT(std::abs(slope / 2) / std::sqrt(e.information(i, i)), 0.05) << "direction " << i;
  }
}

TEST(PoseOptimizer, WorksWithoutAnyDepth) {
  synthetic::BundleOptions o;
  o.points = 200;
  o.depth_share = 0;
  Case s = make(o);
  EXPECT_LT(synthetic::pose_error(s.run().camera_from_world, s.view.truth), 0.01);
}

TEST(PoseOptimizer, NanNeverReachesThePose) {
  synthetic::BundleOptions o;
  o.points = 200;
  Case s = make(o);
  for (std::size_t i = 0; i < s.view.points.size(); i += 4) {
    switch (i / 4 % 4) {
      case 0:
        s.view.points[i].y() = synthetic::kNan;
        break;
      case 1:
        s.view.observations[i].pixel.x() = synthetic::kNan;
        break;
      case 2:
        s.view.observations[i].inverse_variance_px = synthetic::kNan;
        break;
      default:
        s.view.observations[i].disparity_px = synthetic::kNan;
        break;
    }
  }
  const PoseEstimate e = s.run();
  EXPECT_LT(synthetic::pose_error(e.camera_from_world, s.view.truth), 0.01);
  EXPECT_EQ(s.inlier[0], 0);
  EXPECT_EQ(s.inlier[4], 0);
  EXPECT_EQ(s.inlier[8], 0);
}

void expect_refused(Case s) {
  const PoseEstimate e = s.run();
  EXPECT_EQ(e.inliers, 0);
  EXPECT_EQ(std::count(s.inlier.begin(), s.inlier.end(), 1), 0);
  EXPECT_EQ(s.inlier.size(), s.view.points.size());
  if (s.initial.is_finite()) {
    EXPECT_LT(synthetic::pose_error(e.camera_from_world, s.initial), 1e-15);
  }
}

TEST(PoseOptimizer, RefusesTooFewAndDegenerateObservations) {
  synthetic::BundleOptions o;
  o.points = 200;
  const Case good = make(o);
  Case none = good;
  none.view.points.clear();
  none.view.observations.clear();
  expect_refused(none);
  Case two = good;
  two.view.points.resize(2);
  two.view.observations.resize(2);
  expect_refused(two);
  Case one_place = good;
  for (std::size_t i = 1; i < one_place.view.points.size(); ++i) {
    one_place.view.points[i] = one_place.view.points[0];
    one_place.view.observations[i] = one_place.view.observations[0];
  }
  expect_refused(one_place);
  Case behind = good;
  for (auto& p : behind.view.points) p = behind.initial.inverse() * -(behind.initial * p);
  expect_refused(behind);
  Case nan_start = good;
  nan_start.initial = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(synthetic::kNan, 0, 0));
  expect_refused(nan_start);
}

TEST(PoseOptimizer, RefusesPointsOnALine) {
  synthetic::BundleOptions o;
  o.points = 50;
  o.pixel_noise_px = o.disparity_noise_px = 0;
  Case s = make(o, 0);
  const Intrinsics c = Intrinsics::of(synthetic::vga_camera());
  for (std::size_t i = 0; i < s.view.points.size(); ++i) {
    const double k = 0.02 * static_cast<double>(i);
    s.view.points[i] = Eigen::Vector3d(-0.5 + k, 0.3 * k, 3 + 0.5 * k);
    const Eigen::Vector3d p = s.view.truth * s.view.points[i];
    s.view.observations[i].pixel = {c.fx_px * p.x() / p.z() + c.cx_px, c.fy_px * p.y() / p.z() + c.cy_px};
    s.view.observations[i].disparity_px = c.focal_baseline_px_m / p.z();
  }
  expect_refused(s);
}

TEST(PoseOptimizer, ThreePointsWithDepthAreEnough) {
  synthetic::BundleOptions o;
  o.points = 100;
  o.pixel_noise_px = o.disparity_noise_px = 0;
  o.depth_share = 1;
  Case s = make(o, 0.01);
  s.view.points.resize(3);
  s.view.observations.resize(3);
  const PoseEstimate e = s.run();
  EXPECT_EQ(e.inliers, 3);
  EXPECT_LT(synthetic::pose_error(e.camera_from_world, s.view.truth), 1e-6);
}

TEST(PoseOptimizer, ThrowsWhenTheArraysDiffer) {
  std::vector<std::uint8_t> inlier;
  const std::vector<Eigen::Vector3d> points(3, Eigen::Vector3d::Zero());
  EXPECT_THROW(optimize_pose(Intrinsics::of(synthetic::vga_camera()), SE3(), points, {}, {}, inlier),
               std::invalid_argument);
}

}  // namespace
}  // namespace semvslam
