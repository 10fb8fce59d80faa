#include "semvslam/eval/trajectory_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

using ::testing::HasSubstr;

constexpr double kRadPerDeg = 0.017453292519943295;

/// A path in all directions, 10 Hz.
Trajectory path(int count) {
  Trajectory out;
  for (int k = 0; k < count; ++k) {
    const double s = 0.1 * k;
    SE3::Tangent xi;
    xi << std::sin(s), std::cos(0.7 * s), 0.3 * s, 0.4 * std::sin(s), 0.2 * s, 0.1;
    out.push_back({TimeStamp::from_seconds(1.7e9 + s), SE3::exp(xi)});
  }
  return out;
}

std::vector<PosePair> one_to_one(std::size_t count) {
  std::vector<PosePair> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back({i, i});
  return out;
}

Trajectory moved(const Trajectory& in, const SE3& by, double scale = 1) {
  Trajectory out = in;
  for (StampedPose& p : out) {
    const SE3 m = by * p.world_from_camera;
    p.world_from_camera = SE3(m.rotation(), scale * m.translation());
  }
  return out;
}

SE3 some_motion() {
  SE3::Tangent xi;
  xi << 3, -2, 5, 0.5, -1, 2;
  return SE3::exp(xi);
}

TEST(AbsoluteError, IsZeroForTheSamePathInAnotherFrame) {
  const Trajectory truth = path(50);
  const auto e = absolute_error(truth, moved(truth, some_motion()), one_to_one(50), false);
  ASSERT_TRUE(e);
  EXPECT_LT(e->statistics_m.max, 1e-12);
}

TEST(AbsoluteError, ScaleIsOnlyCorrectedWhenAsked) {
  const Trajectory truth = path(50);
  const Trajectory half = moved(truth, some_motion(), 0.5);
  const auto rigid = absolute_error(truth, half, one_to_one(50), false);
  const auto similar = absolute_error(truth, half, one_to_one(50), true);
  ASSERT_TRUE(rigid && similar);
  EXPECT_GT(rigid->statistics_m.rmse, 0.1);
  EXPECT_LT(similar->statistics_m.max, 1e-12);
  EXPECT_NEAR(similar->reference_from_estimate.scale, 2.0, 1e-12);
}

TEST(AbsoluteError, OfNoiseIsItsSize) {
  const Trajectory truth = path(4000);
  Trajectory noisy = truth;
  Random random(1);
  for (StampedPose& p : noisy) {
    const Eigen::Vector3d noise(random.normal(0, 0.01), random.normal(0, 0.01), random.normal(0, 0.01));
    p.world_from_camera = SE3(p.world_from_camera.rotation(), p.world_from_camera.translation() + noise);
  }
  const auto e = absolute_error(truth, noisy, one_to_one(4000), false);
  ASSERT_TRUE(e);
  EXPECT_NEAR(e->statistics_m.rmse, 0.01 * std::sqrt(3.0), 0.0003);
}

TEST(AbsoluteError, RefusesTooFewPairsAndALine) {
  const Trajectory truth = path(10);
  EXPECT_THAT(absolute_error(truth, truth, one_to_one(2), false).error().message, HasSubstr("only 2 poses"));
  Trajectory line = path(10);
  for (std::size_t i = 0; i < line.size(); ++i)
    line[i].world_from_camera = SE3(Eigen::Quaterniond::Identity(), {static_cast<double>(i), 0, 0});
  EXPECT_FALSE(absolute_error(line, line, one_to_one(10), false));
}

/// An estimate that turns by 0.1 degree and slides by 1 mm too much in each step, in the camera's own frame.
Trajectory drifting(const Trajectory& truth) {
  const SE3 fault(Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * kRadPerDeg, Eigen::Vector3d::UnitY())), {0.001, 0, 0});
  Trajectory out = {truth.front()};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const SE3 step = truth[i - 1].world_from_camera.inverse() * truth[i].world_from_camera;
    out.push_back({truth[i].stamp, out.back().world_from_camera * step * fault});
  }
  return out;
}

TEST(RelativeError, OfAConstantFaultPerStep) {
  const Trajectory truth = path(60);
  const auto e = relative_error(truth, drifting(truth), one_to_one(60), {.delta = {1, Delta::Unit::kFrames}});
  ASSERT_TRUE(e);
  EXPECT_EQ(e->steps.size(), 59u);
  EXPECT_NEAR(e->translation_m.rmse, 0.001, 1e-12);
  EXPECT_NEAR(e->translation_m.max, 0.001, 1e-12);
  EXPECT_NEAR(e->rotation_deg.mean, 0.1, 1e-9);
}

TEST(RelativeError, DoesNotDependOnTheFrameOfTheEstimate) {
  const Trajectory truth = path(60), estimate = drifting(truth);
  const auto a = relative_error(truth, estimate, one_to_one(60), {});
  const auto b = relative_error(truth, moved(estimate, some_motion()), one_to_one(60), {});
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(a->translation_m.rmse, b->translation_m.rmse, 1e-12);
  EXPECT_NEAR(a->rotation_deg.rmse, b->rotation_deg.rmse, 1e-9);
}

TEST(RelativeError, OverlappingAndConsecutiveSteps) {
  const Trajectory truth = path(21);
  RelativeErrorOptions options{.delta = {5, Delta::Unit::kFrames}};
  EXPECT_EQ(relative_error(truth, truth, one_to_one(21), options)->steps.size(), 16u);
  options.overlapping = false;
  const auto e = relative_error(truth, truth, one_to_one(21), options);
  ASSERT_EQ(e->steps.size(), 4u);
  EXPECT_EQ(e->steps[3].from, 15u);
  EXPECT_EQ(e->steps[3].to, 20u);
}

TEST(RelativeError, StepsInSecondsFollowTheStamps) {
  const Trajectory truth = path(31);  // 10 Hz: one second is ten frames
  const auto overlapping = relative_error(truth, truth, one_to_one(31), {});
  ASSERT_TRUE(overlapping);
  EXPECT_EQ(overlapping->steps.size(), 21u);
  for (const auto& step : overlapping->steps) EXPECT_EQ(step.to - step.from, 10u);
  const auto consecutive = relative_error(truth, truth, one_to_one(31), {.delta = {}, .overlapping = false});
  ASSERT_EQ(consecutive->steps.size(), 3u);
  EXPECT_EQ(consecutive->steps[2].from, 20u);
}

TEST(RelativeError, StepsInSecondsDoNotSpanALossOfTracking) {
  const Trajectory truth = path(60);
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < 60; ++i)
    if (i < 15 || i >= 40) pairs.push_back({i, i});
  const auto e = relative_error(truth, truth, pairs, {});
  ASSERT_TRUE(e);
  EXPECT_EQ(e->steps.size(), 5u + 10u);  // 0..4 -> 10..14 and 40..49 -> 50..59
}

TEST(RelativeError, RefusesAStepLongerThanTheTrajectory) {
  const Trajectory truth = path(10);
  const auto e = relative_error(truth, truth, one_to_one(10), {.delta = {20, Delta::Unit::kSeconds}});
  ASSERT_FALSE(e);
  EXPECT_THAT(e.error().message, HasSubstr("no two of the 10 paired poses are 20s apart"));
}

TEST(Delta, ParsesSecondsAndFrames) {
  EXPECT_EQ(Delta::parse("1s")->unit, Delta::Unit::kSeconds);
  EXPECT_DOUBLE_EQ(Delta::parse("0.25s")->amount, 0.25);
  EXPECT_EQ(Delta::parse("30f")->text(), "30f");
  for (const char* bad : {"", "s", "1", "1m", "-1s", "0f", "1.5f", "nans", "1 s", "infs", "1e9s"})
    EXPECT_FALSE(Delta::parse(bad)) << bad;
}

}  // namespace
}  // namespace semvslam
