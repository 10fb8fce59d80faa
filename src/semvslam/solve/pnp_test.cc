#include "semvslam/solve/pnp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "semvslam/base/random.h"
#include "semvslam/solve/synthetic_test_scenes.h"

namespace semvslam {
namespace {

using Triple = std::array<Eigen::Vector3d, 3>;

TEST(P3p, FindsTheTruePoseAmongItsSolutions) {
  Random random(1, "p3p");
  int found = 0;
  std::size_t most = 0;
  for (int k = 0; k < 1000; ++k) {
    SE3::Tangent xi;
    for (int i = 0; i < 6; ++i) xi[i] = random.uniform(-1.5, 1.5);
    const SE3 truth = SE3::exp(xi);
    Triple directions, points;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 5));
      directions[i] = p.normalized();
      points[i] = truth.inverse() * p;
    }
    std::vector<SE3> solutions;
    solve_p3p(directions, points, solutions);
    double best = 1;
    for (const SE3& s : solutions) {
      best = std::min(best, synthetic::pose_error(s, truth));
      for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(((s * points[i]).normalized() - directions[i]).norm(), 1e-6);
    }
    found += best < 1e-5;
    most = std::max(most, solutions.size());
  }
  EXPECT_GE(found, 998);  // near the critical cylinder two solutions merge and digits are lost
  EXPECT_GT(most, 1u);
}

TEST(P3p, SymmetricPyramid) {
  // The linear equation for one ratio vanishes here; all sides and angles are equal.
  Triple directions, points;
  for (std::size_t i = 0; i < 3; ++i) {
    const double a = 2.0943951023931953 * static_cast<double>(i);
    points[i] = {std::cos(a), std::sin(a), 3};
    directions[i] = points[i].normalized();
  }
  std::vector<SE3> solutions;
  solve_p3p(directions, points, solutions);
  double best = 1;
  for (const SE3& s : solutions) best = std::min(best, synthetic::pose_error(s, SE3()));
  EXPECT_LT(best, 1e-6);
}

TEST(P3p, NothingForDegenerateInput) {
  std::vector<SE3> solutions;
  const Eigen::Vector3d z(0, 0, 1), x = Eigen::Vector3d(0.3, 0, 1).normalized(),
                                    y = Eigen::Vector3d(0, 0.3, 1).normalized();
  solve_p3p({z, x, y}, {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(1, 0, 2), Eigen::Vector3d(2, 0, 2)}, solutions);
  solve_p3p({z, z, z}, {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(1, 0, 2), Eigen::Vector3d(0, 1, 2)}, solutions);
  solve_p3p({z, x, y}, {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0, 0, 2)}, solutions);
  solve_p3p({z, x, y}, {Eigen::Vector3d(0, 0, std::nan("")), Eigen::Vector3d(1, 0, 2), Eigen::Vector3d(0, 1, 2)},
            solutions);
  solve_p3p({z, x, Eigen::Vector3d(0, std::nan(""), 1)},
            {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(1, 0, 2), Eigen::Vector3d(0, 1, 2)}, solutions);
  EXPECT_TRUE(solutions.empty());
}

synthetic::View view(double outliers, double depth_share = 0.8) {
  synthetic::BundleOptions o;
  o.points = 200;
  o.outlier_share = outliers;
  o.depth_share = depth_share;
  return synthetic::make_view(o);
}

TEST(Pnp, FindsThePoseAmongSixtyPercentOutliers) {
  const synthetic::View v = view(0.6);
  const auto r = estimate_pose(synthetic::kVga, v.points, v.observations);
  ASSERT_TRUE(r.ok());
  EXPECT_LT(synthetic::pose_error(r->pose.camera_from_world, v.truth), 0.01);
  int wrong = 0, lost = 0;
  for (std::size_t i = 0; i < v.points.size(); ++i) {
    wrong += r->inlier[i] && v.is_outlier[i];
    lost += !r->inlier[i] && !v.is_outlier[i];
  }
  EXPECT_LE(wrong, 1);
  EXPECT_LT(lost, 12);  // 5 % by the chi^2 limit
}

TEST(Pnp, NeedsNoDepth) {
  const synthetic::View v = view(0.3, 0);
  const auto r = estimate_pose(synthetic::kVga, v.points, v.observations);
  ASSERT_TRUE(r.ok());
  EXPECT_LT(synthetic::pose_error(r->pose.camera_from_world, v.truth), 0.02);
}

TEST(Pnp, SameSeedSameBytes) {
  const synthetic::View v = view(0.5);
  const auto a = estimate_pose(synthetic::kVga, v.points, v.observations),
             b = estimate_pose(synthetic::kVga, v.points, v.observations);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->pose.camera_from_world.translation(), b->pose.camera_from_world.translation());
  EXPECT_EQ(a->iterations, b->iterations);
}

TEST(Pnp, RefusesWhatHasNoPose) {
  const synthetic::View v = view(1.0);
  const auto garbage = estimate_pose(synthetic::kVga, v.points, v.observations);
  ASSERT_FALSE(garbage.ok());
  EXPECT_NE(garbage.error().message.find("agree"), std::string::npos);
  const auto few = estimate_pose(synthetic::kVga, std::span(v.points).first(3), std::span(v.observations).first(3));
  ASSERT_FALSE(few.ok());
  EXPECT_NE(few.error().message.find("at least 4"), std::string::npos);
  EXPECT_FALSE(estimate_pose({}, v.points, v.observations).ok());
}

TEST(Pnp, NanMatchesAreLeftOut) {
  synthetic::View v = view(0.1);
  for (std::size_t i = 0; i < v.points.size(); i += 3) {
    if (i % 2) {
      v.points[i].x() = std::nan("");
    } else {
      v.observations[i].pixel.y() = std::nan("");
    }
  }
  const auto r = estimate_pose(synthetic::kVga, v.points, v.observations);
  ASSERT_TRUE(r.ok());
  EXPECT_LT(synthetic::pose_error(r->pose.camera_from_world, v.truth), 0.01);
}

}  // namespace
}  // namespace semvslam
