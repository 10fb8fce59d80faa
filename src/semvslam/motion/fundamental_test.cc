#include "semvslam/motion/fundamental.h"

#include <gtest/gtest.h>

#include "semvslam/geometry/epipolar.h"
#include "semvslam/motion/motion_test_support.h"

namespace semvslam {
namespace {

using motion_testing::rotation;
using motion_testing::translation;

struct Pairs {
  std::vector<Eigen::Vector2d> a, b;
};

// @param depth_of the depth of a pixel of the first image.
template <typename Depth>
Pairs make_pairs(const SE3& b_from_a, Depth depth_of, double outlier_share = 0, int count = 200) {
  const Camera camera = motion_testing::test_camera();
  Random random(5, "fundamental.test");
  Pairs pairs;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d pixel(random.uniform(20, 620), random.uniform(20, 460));
    const Eigen::Vector2d to = camera.project(b_from_a * camera.back_project(pixel, depth_of(pixel, random)));
    const bool outlier = random.chance(outlier_share);
    pairs.a.push_back(pixel);
    pairs.b.push_back(outlier ? to + Eigen::Vector2d(random.uniform(-30, 30), random.uniform(-30, 30))
                              : to + Eigen::Vector2d(random.normal(0, 0.2), random.normal(0, 0.2)));
  }
  return pairs;
}

const auto kRoom = [](const Eigen::Vector2d&, Random& random) { return random.uniform(1.0, 5.0); };

TEST(Fundamental, FindsTheEpipolarLinesAmongOutliers) {
  const SE3 motion = rotation(0.01, 0.03, 0) * translation(-0.15, 0.02, 0.03);
  const Pairs pairs = make_pairs(motion, kRoom, 0.25);
  const FundamentalEstimate estimate = estimate_fundamental(pairs.a, pairs.b, {});
  ASSERT_EQ(estimate.state, FundamentalState::kUsable);
  EXPECT_GT(estimate.inliers, 140);
  const Camera camera = motion_testing::test_camera();
  double worst = 0;
  for (const double depth : {1.2, 2.0, 4.0})
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(100, 100), {500, 120}, {320, 400}}) {
      const Eigen::Vector2d to = camera.project(motion * camera.back_project(pixel, depth));
      worst = std::max(worst, epipolar_distance_px(estimate.matrix, pixel, to));
    }
  EXPECT_LT(worst, 0.5);
}

TEST(Fundamental, TooFewPairs) {
  const Pairs pairs = make_pairs(translation(0.1, 0, 0), kRoom, 0, 12);
  EXPECT_EQ(estimate_fundamental(pairs.a, pairs.b, {}).state, FundamentalState::kTooFewPairs);
  EXPECT_EQ(estimate_fundamental({}, {}, {}).state, FundamentalState::kTooFewPairs);
}

TEST(Fundamental, StillCamera) {
  const Pairs pairs = make_pairs(translation(0.0003, 0, 0), kRoom);
  EXPECT_EQ(estimate_fundamental(pairs.a, pairs.b, {}).state, FundamentalState::kStill);
}

TEST(Fundamental, PureRotation) {
  const Pairs pairs = make_pairs(rotation(0.02, 0.05, 0.01), kRoom);
  const FundamentalEstimate estimate = estimate_fundamental(pairs.a, pairs.b, {});
  EXPECT_EQ(estimate.state, FundamentalState::kHomography);
  EXPECT_GT(estimate.homography_share, 0.95);
}

TEST(Fundamental, PlanarScene) {
  const auto wall = [](const Eigen::Vector2d& pixel, Random&) { return 2 + 0.001 * pixel.x(); };
  const Pairs pairs = make_pairs(translation(-0.15, 0.02, 0), wall);
  EXPECT_EQ(estimate_fundamental(pairs.a, pairs.b, {}).state, FundamentalState::kHomography);
}

TEST(Fundamental, NoConsensusInNoise) {
  Random random(1, "noise");
  Pairs pairs;
  for (int i = 0; i < 100; ++i) {
    pairs.a.emplace_back(random.uniform(0, 640), random.uniform(0, 480));
    pairs.b.emplace_back(random.uniform(0, 640), random.uniform(0, 480));
  }
  EXPECT_EQ(estimate_fundamental(pairs.a, pairs.b, {}).state, FundamentalState::kNoConsensus);
}

}  // namespace
}  // namespace semvslam
