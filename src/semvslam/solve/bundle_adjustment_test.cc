#include "semvslam/solve/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "semvslam/solve/residuals.h"
#include "semvslam/solve/synthetic_test_scenes.h"

namespace semvslam {
namespace {

double worst_pose(const std::vector<SE3>& a, const std::vector<SE3>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, (a[i] * b[i].inverse()).log().norm());
  return worst;
}

bool identical(const std::vector<SE3>& a, const std::vector<SE3>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const SE3& x, const SE3& y) {
    return x.translation() == y.translation() && x.rotation().coeffs() == y.rotation().coeffs();
  });
}

double rms_point(const BaProblem& p, const std::vector<Eigen::Vector3d>& truth) {
  double squared = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) squared += (p.points[i] - truth[i]).squaredNorm();
  return std::sqrt(squared / static_cast<double>(truth.size()));
}

synthetic::BundleOptions small() {
  synthetic::BundleOptions o;
  o.poses = 8;
  o.fixed = 2;
  o.points = 300;
  o.edges_per_point = 5;
  return o;
}

TEST(BundleAdjustment, ExactDataGiveTheExactScene) {
  synthetic::BundleOptions o = small();
  o.pixel_noise_px = o.disparity_noise_px = 0;
  synthetic::Bundle b = synthetic::make_bundle(o);
  std::vector<std::uint8_t> inlier;
  BaOptions options;
  options.robust_iterations = options.final_iterations = 15;
  options.relative_cost_tolerance = 0;
  const BaSummary s = adjust_bundle(b.problem, options, inlier);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(s.final_cost, 1e-8 * s.initial_cost);
  EXPECT_LT(worst_pose(b.problem.poses, b.true_poses), 1e-6);
  EXPECT_EQ(s.outlier_edges, 0);
}

TEST(BundleAdjustment, RecoversTheSceneUnderNoiseAndOutliers) {
  synthetic::BundleOptions o = small();
  o.outlier_share = 0.08;
  o.depth_outlier_share = 0.1;
  synthetic::Bundle b = synthetic::make_bundle(o);
  std::vector<std::uint8_t> inlier;
  BaOptions options;
  options.robust_iterations = 10;
  const BaSummary s = adjust_bundle(b.problem, options, inlier);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(worst_pose(b.problem.poses, b.true_poses), 0.006);
  int missed = 0, lost = 0, outliers = 0;
  for (std::size_t i = 0; i < inlier.size(); ++i) {
    outliers += b.is_outlier[i];
    missed += b.is_outlier[i] && inlier[i];
    lost += !b.is_outlier[i] && !inlier[i];
  }
  const int edges = static_cast<int>(inlier.size());
  ASSERT_GT(outliers, 50);
  EXPECT_LT(missed, 0.05 * outliers);
  EXPECT_LT(lost, 0.12 * edges);  // 5 % by the chi^2 limit itself, some more beside wrong ones
  EXPECT_EQ(s.outlier_edges, std::count(inlier.begin(), inlier.end(), 0));
}

// At the solution no small move of any pose or point may lower an independently evaluated cost.
TEST(BundleAdjustment, EndsInAMinimum) {
  synthetic::BundleOptions o = small();
  o.points = 120;
  synthetic::Bundle b = synthetic::make_bundle(o);
  std::vector<std::uint8_t> inlier;
  BaOptions options;
  options.robust_iterations = options.final_iterations = 20;
  options.relative_cost_tolerance = 1e-12;
  options.chi2_pixel = options.chi2_disparity = 1e6;  // plain least squares
  adjust_bundle(b.problem, options, inlier);
  const auto cost = [&](const BaProblem& p) {
    double sum = 0;
    for (const auto& e : p.edges) {
      const Eigen::Vector3d r = dense_residual(p.camera, p.poses[e.pose], p.points[e.point], e.observation).value;
      sum += e.observation.inverse_variance_px * r.head<2>().squaredNorm();
      sum += e.observation.inverse_variance_disparity * r.z() * r.z();
    }
    return sum;
  };
  const double best = cost(b.problem);
  for (std::size_t i = 2; i < b.problem.poses.size(); ++i) {
    for (int d = 0; d < 12; ++d) {
      BaProblem moved = b.problem;
      moved.poses[i] = SE3::exp((d % 2 ? 1e-5 : -1e-5) * SE3::Tangent::Unit(d / 2)) * moved.poses[i];
      EXPECT_GT(cost(moved), best) << "pose " << i << " direction " << d;
    }
  }
  for (std::size_t i = 0; i < b.problem.points.size(); i += 10) {
    for (int d = 0; d < 6; ++d) {
      BaProblem moved = b.problem;
      moved.points[i] += (d % 2 ? 1e-4 : -1e-4) * Eigen::Vector3d::Unit(d / 2);
      EXPECT_GT(cost(moved), best) << "point " << i << " direction " << d;
    }
  }
}

TEST(BundleAdjustment, SameBytesTwiceAndForAnyOrderOfEdges) {
  synthetic::BundleOptions o = small();
  o.outlier_share = 0.05;
  synthetic::Bundle a = synthetic::make_bundle(o);
  BaProblem again = a.problem, shuffled = a.problem;
  std::reverse(shuffled.edges.begin(), shuffled.edges.end());
  std::vector<std::uint8_t> ia, ib, ic;
  adjust_bundle(a.problem, {}, ia);
  adjust_bundle(again, {}, ib);
  adjust_bundle(shuffled, {}, ic);
  std::reverse(ic.begin(), ic.end());
  EXPECT_EQ(ia, ib);
  EXPECT_EQ(ia, ic);
  EXPECT_TRUE(identical(a.problem.poses, again.poses));
  EXPECT_TRUE(identical(a.problem.poses, shuffled.poses));
  EXPECT_EQ(a.problem.points, again.points);
  EXPECT_EQ(a.problem.points, shuffled.points);
}

TEST(BundleAdjustment, FixedPosesStayAndAllFixedStillMovesPoints) {
  synthetic::BundleOptions o = small();
  o.fixed = o.poses;
  synthetic::Bundle b = synthetic::make_bundle(o);
  const double before = rms_point(b.problem, b.true_points);
  std::vector<std::uint8_t> inlier;
  ASSERT_TRUE(adjust_bundle(b.problem, {}, inlier).usable);
  EXPECT_LT(rms_point(b.problem, b.true_points), 0.6 * before);
  EXPECT_TRUE(identical(b.problem.poses, b.true_poses));
}

TEST(BundleAdjustment, NanObservationsAndPointsAreLeftOut) {
  synthetic::Bundle b = synthetic::make_bundle(small());
  for (std::size_t i = 0; i < b.problem.edges.size(); i += 10) {
    PointObservation& ob = b.problem.edges[i].observation;
    (i % 20 ? ob.pixel.y() : ob.disparity_px) = synthetic::kNan;
  }
  b.problem.points[7].x() = synthetic::kNan;
  std::vector<std::uint8_t> inlier;
  ASSERT_TRUE(adjust_bundle(b.problem, {}, inlier).usable);
  EXPECT_LT(worst_pose(b.problem.poses, b.true_poses), 0.006);
  for (std::size_t i = 0; i < b.problem.points.size(); ++i) EXPECT_EQ(b.problem.points[i].allFinite(), i != 7);
  for (std::size_t i = 0; i < inlier.size(); ++i) {
    if (b.problem.edges[i].point == 7 || !b.problem.edges[i].observation.pixel.allFinite()) {
      EXPECT_EQ(inlier[i], 0);
    }
  }
}

TEST(BundleAdjustment, APointSeenOnceWithoutDepthNeitherMovesNorPulls) {
  synthetic::Bundle b = synthetic::make_bundle(small());
  BaProblem with = b.problem;
  with.points.push_back({0.2, 0.1, 2.5});
  PointObservation ob;
  ob.pixel = {10, 10};  // far from where the point projects
  with.edges.push_back({5, static_cast<std::uint32_t>(with.points.size() - 1), ob});
  std::vector<std::uint8_t> inlier;
  adjust_bundle(b.problem, {}, inlier);
  adjust_bundle(with, {}, inlier);
  EXPECT_EQ(with.points.back(), Eigen::Vector3d(0.2, 0.1, 2.5));
  EXPECT_EQ(inlier.back(), 0);
  EXPECT_TRUE(identical(with.poses, b.problem.poses));
}

TEST(BundleAdjustment, APoseWithoutEdgesStays) {
  synthetic::Bundle b = synthetic::make_bundle(small());
  std::erase_if(b.problem.edges, [](const auto& e) { return e.pose == 4; });
  const SE3 before = b.problem.poses[4];
  std::vector<std::uint8_t> inlier;
  ASSERT_TRUE(adjust_bundle(b.problem, {}, inlier).usable);
  EXPECT_EQ(b.problem.poses[4].translation(), before.translation());
  EXPECT_LT((b.problem.poses[5] * b.true_poses[5].inverse()).log().norm(), 0.006);
}

TEST(BundleAdjustment, AStopRequestEndsItWithoutHarm) {
  synthetic::Bundle b = synthetic::make_bundle(small());
  const BaProblem before = b.problem;
  std::stop_source source;
  source.request_stop();
  std::vector<std::uint8_t> inlier;
  const BaSummary s = adjust_bundle(b.problem, {}, inlier, source.get_token());
  EXPECT_TRUE(s.stopped);
  EXPECT_EQ(s.accepted_steps, 0);
  EXPECT_EQ(inlier.size(), b.problem.edges.size());
  EXPECT_TRUE(identical(b.problem.poses, before.poses));
}

TEST(BundleAdjustment, RefusesWhatCannotBeAdjusted) {
  const synthetic::Bundle good = synthetic::make_bundle(small());
  std::vector<std::uint8_t> inlier;
  BaProblem floating = good.problem;
  floating.pose_fixed.assign(floating.poses.size(), 0);
  EXPECT_FALSE(adjust_bundle(floating, {}, inlier).usable);
  EXPECT_EQ(floating.points, good.problem.points);
  BaProblem nan_pose = good.problem;
  nan_pose.poses[3] = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, synthetic::kNan, 0));
  EXPECT_FALSE(adjust_bundle(nan_pose, {}, inlier).usable);
  BaProblem no_edges = good.problem;
  no_edges.edges.clear();
  EXPECT_FALSE(adjust_bundle(no_edges, {}, inlier).usable);
  BaProblem nothing;
  EXPECT_FALSE(adjust_bundle(nothing, {}, inlier).usable);
}

TEST(BundleAdjustment, ThrowsOnContradictions) {
  const synthetic::Bundle good = synthetic::make_bundle(small());
  std::vector<std::uint8_t> inlier;
  BaProblem twice = good.problem;
  twice.edges.push_back(twice.edges.front());
  EXPECT_THROW(adjust_bundle(twice, {}, inlier), std::invalid_argument);
  BaProblem outside = good.problem;
  outside.edges[0].point = 100000;
  EXPECT_THROW(adjust_bundle(outside, {}, inlier), std::invalid_argument);
  BaProblem short_flags = good.problem;
  short_flags.pose_fixed.pop_back();
  EXPECT_THROW(adjust_bundle(short_flags, {}, inlier), std::invalid_argument);
}

}  // namespace
}  // namespace semvslam
