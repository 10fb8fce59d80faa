#include "semvslam/solve/relative_pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "semvslam/base/random.h"
#include "semvslam/solve/synthetic_test_scenes.h"

namespace semvslam {
namespace {

const SE3 kTruth(Eigen::Quaterniond(0.98, 0.05, -0.15, 0.1), Eigen::Vector3d(0.4, -0.1, 0.2));

struct Matches {
  std::vector<MatchedPoint> points;
  std::vector<std::uint8_t> wrong;
};

// Points with the noise of a depth camera; a share is matched to something else.
Matches make(int n, double outliers) {
  Random random(11, "matches");
  Matches out;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d b(random.uniform(-1, 1), random.uniform(-0.8, 0.8), random.uniform(1.5, 4));
    const Eigen::Vector3d a = kTruth * b;
    const auto see = [&](const Eigen::Vector3d& p, Eigen::Vector3d& point) {
      PointObservation o;
      o.pixel = {synthetic::kVga.fx_px * p.x() / p.z() + synthetic::kVga.cx_px + random.normal(0, 0.5),
                 synthetic::kVga.fy_px * p.y() / p.z() + synthetic::kVga.cy_px + random.normal(0, 0.5)};
      o.disparity_px = synthetic::kVga.focal_baseline_px_m / p.z() + random.normal(0, 0.2);
      o.inverse_variance_px = 1;
      const double z = synthetic::kVga.focal_baseline_px_m / o.disparity_px;
      point = {(o.pixel.x() - synthetic::kVga.cx_px) / synthetic::kVga.fx_px * z,
               (o.pixel.y() - synthetic::kVga.cy_px) / synthetic::kVga.fy_px * z, z};
      return o;
    };
    MatchedPoint m;
    m.seen_by_b = see(b, m.in_b);
    const bool wrong = random.chance(outliers);
    const Eigen::Vector3d other(random.uniform(-1, 1), random.uniform(-0.8, 0.8), random.uniform(1.5, 4));
    m.seen_by_a = see(wrong ? other : a, m.in_a);
    out.points.push_back(m);
    out.wrong.push_back(wrong);
  }
  return out;
}

double error(const SE3& a) { return (a * kTruth.inverse()).log().norm(); }

TEST(RelativePose, FindsTheMotionAmongHalfOutliers) {
  const Matches m = make(120, 0.5);
  const auto r = estimate_relative_pose(synthetic::kVga, m.points);
  ASSERT_TRUE(r.ok());
  EXPECT_LT(error(r->a_from_b), 0.02);
  int wrong = 0, kept = 0, right = 0;
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    wrong += r->inlier[i] && m.wrong[i];
    right += !m.wrong[i];
    kept += r->inlier[i] && !m.wrong[i];
  }
  EXPECT_LE(wrong, 1);
  EXPECT_GT(kept, 0.8 * right);
  EXPECT_GT(r->information.diagonal().minCoeff(), 0);
}

TEST(RelativePose, SameSeedSameBytes) {
  const Matches m = make(80, 0.4);
  const auto a = estimate_relative_pose(synthetic::kVga, m.points),
             b = estimate_relative_pose(synthetic::kVga, m.points);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->a_from_b.translation(), b->a_from_b.translation());
  EXPECT_EQ(a->inlier, b->inlier);
}

TEST(RelativePose, RefusesGarbageAndTooFew) {
  const Matches garbage = make(80, 1.0);
  EXPECT_FALSE(estimate_relative_pose(synthetic::kVga, garbage.points).ok());
  const Matches few = make(2, 0);
  const auto r = estimate_relative_pose(synthetic::kVga, few.points);
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().message.find("at least 3"), std::string::npos);
  EXPECT_FALSE(estimate_relative_pose({}, make(50, 0).points).ok());
  std::vector<MatchedPoint> one_place(50, make(1, 0).points[0]);
  EXPECT_FALSE(estimate_relative_pose(synthetic::kVga, one_place).ok());
}

TEST(RelativePose, NanMatchesAreLeftOut) {
  Matches m = make(60, 0);
  for (std::size_t i = 0; i < 60; i += 3) m.points[i].in_a.z() = std::nan("");
  const auto r = estimate_relative_pose(synthetic::kVga, m.points);
  ASSERT_TRUE(r.ok());
  EXPECT_LT(error(r->a_from_b), 0.02);
  for (std::size_t i = 0; i < 60; i += 3) EXPECT_EQ(r->inlier[i], 0);
}

}  // namespace
}  // namespace semvslam
