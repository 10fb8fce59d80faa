#include "semvslam/geometry/epipolar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

using Pixels = std::vector<Eigen::Vector2d>;

Camera vga() {
  Camera c;
  c.width_px = 640;
  c.height_px = 480;
  c.fx_px = 525;
  c.fy_px = 520;
  c.cx_px = 320;
  c.cy_px = 240;
  return c;
}

struct TwoImages {
  SE3 b_from_a{Eigen::Quaterniond(0.995, 0.02, -0.07, 0.03), Eigen::Vector3d(0.3, -0.1, 0.15)};
  Pixels a, b;
  explicit TwoImages(int n, double noise_px = 0, std::uint64_t seed = 1) {
    Random random(seed, "epipolar");
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector3d p(random.uniform(-1.5, 1.5), random.uniform(-1, 1), random.uniform(2, 6));
      const auto noise = [&] { return Eigen::Vector2d(random.normal(0, noise_px), random.normal(0, noise_px)); };
      a.push_back(vga().project(p) + noise());
      b.push_back(vga().project(b_from_a * p) + noise());
    }
  }
};

TEST(Epipolar, StaticPointsLieOnTheLinesOfAKnownPose) {
  const TwoImages images(50);
  const Eigen::Matrix3d f = fundamental_from_pose(vga(), vga(), images.b_from_a);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_LT(epipolar_distance_px(f, images.a[i], images.b[i]), 1e-9);
    EXPECT_LT(sampson_distance_px(f, images.a[i], images.b[i]), 1e-9);
  }
}

TEST(Epipolar, DistanceIsMeasuredAcrossTheLine) {
  // Camera b stands to the right: lines are rows, so only a vertical shift counts.
  const Eigen::Matrix3d f = fundamental_from_pose(vga(), vga(), SE3(Eigen::Quaterniond::Identity(), {-0.2, 0, 0}));
  const Eigen::Vector2d a(100, 200);
  EXPECT_NEAR(epipolar_distance_px(f, a, {80, 207}), 7, 1e-9);
  EXPECT_NEAR(epipolar_distance_px(f, a, {30, 200}), 0, 1e-9);
  EXPECT_NEAR(sampson_distance_px(f, a, {80, 207}), 7 / std::sqrt(2.0), 1e-9);
}

TEST(Epipolar, NoLineNoDistance) {
  const Eigen::Matrix3d zero = fundamental_from_pose(vga(), vga(), SE3(Eigen::Quaterniond(0.9, 0.1, 0, 0), {0, 0, 0}));
  EXPECT_EQ(zero.norm(), 0);
  EXPECT_TRUE(std::isinf(epipolar_distance_px(zero, {1, 2}, {3, 4})));
  EXPECT_TRUE(std::isinf(sampson_distance_px(zero, {1, 2}, {3, 4})));
}

TEST(Epipolar, EightPointsGiveTheMatrixOfThePose) {
  const TwoImages images(8);
  const auto f = fundamental_eight_point(images.a, images.b);
  ASSERT_TRUE(f.ok());
  Eigen::Matrix3d expected = fundamental_from_pose(vga(), vga(), images.b_from_a);
  expected /= expected.norm();
  EXPECT_LT(std::min((*f - expected).norm(), (*f + expected).norm()), 1e-7);
  EXPECT_NEAR(f->determinant(), 0, 1e-15);
}

TEST(Epipolar, ManyNoisyPointsLeaveTheErrorNearTheNoise) {
  const TwoImages images(300, 0.5);
  const auto f = fundamental_eight_point(images.a, images.b);
  ASSERT_TRUE(f.ok());
  const TwoImages exact(300, 0, 2);
  double worst = 0;
  for (std::size_t i = 0; i < 300; ++i) worst = std::max(worst, epipolar_distance_px(*f, exact.a[i], exact.b[i]));
  EXPECT_LT(worst, 1.5);
}

TEST(Epipolar, RefusesWhatDoesNotDetermineIt) {
  const TwoImages images(20);
  const Pixels seven(images.a.begin(), images.a.begin() + 7);
  EXPECT_FALSE(fundamental_eight_point(seven, seven).ok());
  EXPECT_FALSE(fundamental_eight_point(images.a, seven).ok());
  EXPECT_FALSE(fundamental_eight_point(images.a, images.a).ok());  // no motion
  EXPECT_FALSE(fundamental_eight_point(Pixels(9, images.a[0]), Pixels(9, images.b[0])).ok());
  Pixels line_a, line_b;
  for (int i = 0; i < 20; ++i) {
    line_a.emplace_back(10 * i, 5 * i);
    line_b.emplace_back(10 * i + 3, 7 * i);
  }
  EXPECT_FALSE(fundamental_eight_point(line_a, line_b).ok());
  // The same of eight, which are solved another way.
  const auto first_eight = [](const Pixels& pixels) { return Pixels(pixels.begin(), pixels.begin() + 8); };
  EXPECT_FALSE(fundamental_eight_point(first_eight(line_a), first_eight(line_b)).ok());
  EXPECT_FALSE(fundamental_eight_point(first_eight(images.a), first_eight(images.a)).ok());
  Pixels twice_a = first_eight(images.a), twice_b = first_eight(images.b);
  twice_a[7] = twice_a[0], twice_b[7] = twice_b[0];
  EXPECT_FALSE(fundamental_eight_point(twice_a, twice_b).ok());
  Pixels nan = images.b;
  nan[3].x() = std::numeric_limits<double>::quiet_NaN();
  const auto result = fundamental_eight_point(images.a, nan);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("pair 3"), std::string::npos);
}

}  // namespace
}  // namespace semvslam
