#include "semvslam/geometry/triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

using Verdict = TriangulationVerdict;

class TriangulationTest : public testing::Test {
 protected:
  TriangulationTest() {
    camera_.width_px = 640;
    camera_.height_px = 480;
    camera_.fx_px = 525;
    camera_.fy_px = 520;
    camera_.cx_px = 320;
    camera_.cy_px = 240;
  }
  Triangulation run(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const TriangulationLimits& limits = {}) const {
    return triangulate(camera_, a_from_world_, a, camera_, b_from_world_, b, limits);
  }
  Eigen::Vector2d in_a(const Eigen::Vector3d& p) const { return camera_.project(a_from_world_ * p); }
  Eigen::Vector2d in_b(const Eigen::Vector3d& p) const { return camera_.project(b_from_world_ * p); }

  Camera camera_;
  SE3 a_from_world_{Eigen::Quaterniond(0.99, 0.02, 0.05, -0.03), Eigen::Vector3d(0.1, 0, 0.2)};
  SE3 b_from_world_{Eigen::Quaterniond(0.98, -0.02, -0.05, 0.03), Eigen::Vector3d(-0.3, 0.1, 0.1)};
};

TEST_F(TriangulationTest, FindsThePointExactly) {
  Random random(1, "triangulation");
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d truth(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 6));
    const Triangulation t = run(in_a(truth), in_b(truth));
    ASSERT_TRUE(t.good());
    EXPECT_LT((t.point_in_world - truth).norm(), 1e-9);
    EXPECT_NEAR(t.parallax_rad,
                parallax_rad(truth, a_from_world_.inverse().translation(), b_from_world_.inverse().translation()),
                1e-12);
  }
}

TEST_F(TriangulationTest, MinimisesTheSquaredPixelErrors) {
  const Eigen::Vector3d truth(0.3, -0.2, 3);
  const Eigen::Vector2d a = in_a(truth) + Eigen::Vector2d(0.8, -1.2), b = in_b(truth) + Eigen::Vector2d(-0.5, 1.5);
  const Triangulation t = run(a, b);
  ASSERT_TRUE(t.good());
  const auto cost = [&](const Eigen::Vector3d& p) { return (a - in_a(p)).squaredNorm() + (b - in_b(p)).squaredNorm(); };
  EXPECT_NEAR(t.error_a_px, (a - in_a(t.point_in_world)).norm(), 1e-9);
  EXPECT_NEAR(t.error_b_px, (b - in_b(t.point_in_world)).norm(), 1e-9);
  for (int axis = 0; axis < 3; ++axis)
    for (const double step : {-1e-3, 1e-3})
      EXPECT_GT(cost(t.point_in_world + step * Eigen::Vector3d::Unit(axis)), cost(t.point_in_world));
}

TEST_F(TriangulationTest, SaysWhyItRefuses) {
  const Eigen::Vector3d far(5, 3, 900);
  EXPECT_EQ(run(in_a(far), in_b(far)).verdict, Verdict::kLowParallax);
  const Eigen::Vector3d behind(0.1, 0.1, -3);
  EXPECT_EQ(run(in_a(behind), in_b(behind)).verdict, Verdict::kBehind);
  const Eigen::Vector3d p(0.3, -0.2, 3);
  EXPECT_EQ(run(in_a(p), in_b(p) + Eigen::Vector2d(0, 15)).verdict, Verdict::kReprojection);
  TriangulationLimits near;
  near.max_depth_m = 2;
  EXPECT_EQ(run(in_a(p), in_b(p), near).verdict, Verdict::kBehind);
  const Eigen::Vector2d nan(std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_EQ(run(nan, in_b(p)).verdict, Verdict::kNotFinite);
}

TEST_F(TriangulationTest, SameCameraTwiceHasNoParallax) {
  b_from_world_ = a_from_world_;
  TriangulationLimits none;
  none.min_parallax_rad = 0;
  const Eigen::Vector3d p(0.3, -0.2, 3);
  EXPECT_EQ(run(in_a(p), in_a(p), none).verdict, Verdict::kLowParallax);
}

TEST_F(TriangulationTest, ABlurredSecondViewCountsLess) {
  const Eigen::Vector3d p(0.3, -0.2, 3);
  const Eigen::Vector2d b = in_b(p) + Eigen::Vector2d(0, 6);
  EXPECT_FALSE(run(in_a(p), b).good());
  const Triangulation t = triangulate(camera_, a_from_world_, in_a(p), camera_, b_from_world_, b, {}, 3.0);
  ASSERT_TRUE(t.good());
  EXPECT_LT(t.error_a_px, 0.2 * t.error_b_px);
}

}  // namespace
}  // namespace semvslam
