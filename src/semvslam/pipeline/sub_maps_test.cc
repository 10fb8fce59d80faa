#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/map/map_file.h"
#include "semvslam/pipeline/slam.h"
#include "semvslam/tracking/plane_world_testing.h"

namespace semvslam {
namespace {

using ::testing::HasSubstr;
using testing::PlaneWorld;

constexpr SubMapId kFirst{0}, kSecond{1};
constexpr int kLostBefore = 15;  // frames that are looked for seven times: the first five, then every fifth

/// What the system has to tell.
struct Events : Sink {
  void on_frame(const RgbdFrame&, const TrackResult&) override {}
  void on_event(const std::string& line) override { lines.push_back(line); }
  std::vector<std::string> lines;
};

/// A wall that is longer than three images are wide. The camera sees its left part, is carried to the right with its
/// lens covered, and finds itself where nothing is known.
class SubMapTest : public ::testing::TestWithParam<bool> {
 protected:
  static SE3 at(double x_m, double y_m = 0) { return {Eigen::Quaterniond::Identity(), {x_m, y_m, 0}}; }
  static constexpr double kLeft = -1.2, kRight = 1.9, kStep_m = 0.05;

  std::unique_ptr<Slam> make(Config config = {}) {
    config.deterministic = GetParam();
    auto slam = std::move(Slam::create(config, world.camera())).value();
    slam->add_sink(events);
    return slam;
  }
  TrackResult see(Slam& slam, const SE3& pose, bool dark = false) {
    RgbdFrame frame = world.render(pose, static_cast<int>(truth.size()));
    if (dark) frame.gray.setTo(0);
    truth.push_back(pose);
    const Result<TrackResult> result = slam.process(frame);
    EXPECT_TRUE(result.ok()) << result.error().message;
    last = *result;
    return last;
  }
  void go(Slam& slam, double from, double to) {
    const int steps = static_cast<int>(std::lround(std::abs(to - from) / kStep_m));
    for (int i = 0; i <= steps; ++i) {
      (void)see(slam, at(from + (to - from) * i / steps));
      ASSERT_EQ(last.state, TrackingState::kTracking) << "frame " << truth.size() - 1;
    }
  }
  /// Forth and back: mapping, on a thread of its own, may join sub-maps some frames later.
  void go_until_joined(Slam& slam, double here, double there) {
    for (int way = 0; way < 10 && last.sub_map != kFirst; ++way) {
      go(slam, here, there);
      std::swap(here, there);
    }
  }
  void cover_the_lens(Slam& slam, int frames = 10) {
    for (int i = 0; i < frames; ++i) EXPECT_EQ(see(slam, at(0), true).state, TrackingState::kLost);
  }
  /// Stays about the same place. @return the frames until a sub-map begins.
  int look_around(Slam& slam, double x_m, int most = 40) {
    for (int i = 0; i < most; ++i)
      if (see(slam, at(x_m, 0.01 * std::sin(i))).state == TrackingState::kTracking) return i;
    return most;
  }
  /// In a world whose first camera was there. @param frames as many as there must be.
  void expect_truth(const Trajectory& trajectory, const SE3& first, std::size_t frames) {
    EXPECT_EQ(trajectory.size(), frames);
    for (const StampedPose& pose : trajectory) {
      const auto i = static_cast<std::size_t>(std::lround(pose.stamp.seconds() * 30));
      const SE3 error = pose.world_from_camera.inverse() * (first.inverse() * truth.at(i));
      EXPECT_LT(error.translation().norm(), 0.015) << "frame " << i;
      EXPECT_LT(error.rotation_angle_rad(), 0.01) << "frame " << i;
    }
  }

  const testing_support::TemporaryFolder folder;
  const PlaneWorld world;
  std::vector<SE3> truth;  // world_from_camera by frame
  std::shared_ptr<Events> events = std::make_shared<Events>();
  TrackResult last;
};

TEST_P(SubMapTest, WhatIsSeenWhileThePlaceIsUnknownIsJoinedWhenItIsFound) {
  const auto slam = make();
  go(*slam, kLeft, 0);
  const auto known = truth.size();
  cover_the_lens(*slam);
  EXPECT_EQ(look_around(*slam, kRight), kLostBefore);
  const std::size_t begin = truth.size() - 1;
  EXPECT_EQ(last.sub_map, kSecond);
  EXPECT_TRUE(last.is_key_frame);
  EXPECT_LT(last.world_from_camera.translation().norm(), 1e-9) << "the world is its camera";
  EXPECT_THAT(events->lines, ::testing::ElementsAre(HasSubstr("sub-map 2 begins")));
  go(*slam, kRight, -0.6);
  go_until_joined(*slam, -0.6, 0);
  EXPECT_EQ(last.sub_map, kFirst);
  const SE3 error = last.world_from_camera.inverse() * (at(kLeft).inverse() * truth.back());
  EXPECT_LT(error.translation().norm(), 0.02) << "tracking has moved into the other world";
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_TRUE(slam->check_invariants().ok());
  EXPECT_EQ(events->lines.size(), 2u);
  EXPECT_THAT(events->lines.back(), HasSubstr("sub-map 2 is joined with sub-map 1"));
  const SlamStatistics statistics = slam->statistics();
  EXPECT_EQ(statistics.sub_maps_begun, 1u);
  EXPECT_EQ(statistics.sub_maps_joined, 1u);
  EXPECT_TRUE(statistics.apart.empty());
  EXPECT_EQ(statistics.tracked + statistics.lost, truth.size());
  expect_truth(slam->trajectory(), at(kLeft), known + truth.size() - begin);
}

TEST_P(SubMapTest, ACameraThatIsBackInTheOlderBringsThemTogetherToo) {
  Config config;
  config.tracking.max_frames_between = 5;
  const auto slam = make(config);
  go(*slam, kLeft, 0);
  cover_the_lens(*slam);
  (void)look_around(*slam, kRight);
  go(*slam, kRight, kRight - 0.4);
  cover_the_lens(*slam, 3);
  EXPECT_LE(look_around(*slam, -0.6), 2) << "a lost camera is found in any sub-map";
  EXPECT_EQ(last.sub_map, kFirst);
  go(*slam, -0.6, kRight);
  go(*slam, kRight, 1.0);
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_EQ(slam->statistics().sub_maps_joined, 1u);
  EXPECT_EQ(slam->statistics().tracked + slam->statistics().lost, truth.size());
  expect_truth(slam->trajectory(), at(kLeft), slam->statistics().tracked);
}

TEST_P(SubMapTest, ThoseThatAreNeverJoinedAreNotMixed) {
  const auto slam = make();
  go(*slam, kLeft, 0);
  const auto known = truth.size();
  cover_the_lens(*slam);
  (void)look_around(*slam, kRight);
  const std::size_t begin = truth.size() - 1;
  go(*slam, kRight, kRight - 0.4);
  ASSERT_TRUE(slam->finish().ok());
  const SlamStatistics statistics = slam->statistics();
  EXPECT_EQ(statistics.sub_maps_joined, 0u);
  EXPECT_EQ(statistics.sub_map, kFirst) << "it has more frames";
  EXPECT_EQ(statistics.tracked, known);
  ASSERT_EQ(statistics.apart.size(), 1u);
  EXPECT_EQ(statistics.apart[0].sub_map, kSecond);
  EXPECT_EQ(statistics.apart[0].tracked, truth.size() - begin);
  EXPECT_EQ(statistics.tracked + statistics.apart[0].tracked + statistics.lost, truth.size());
  expect_truth(slam->trajectory(), at(kLeft), known);
  expect_truth(slam->trajectory(kSecond), truth[begin], truth.size() - begin);
  EXPECT_TRUE(slam->trajectory(SubMapId(2)).empty());

  EXPECT_EQ(slam->key_frame_trajectory().size(), statistics.key_frames);
  EXPECT_EQ(slam->key_frame_masks(kSecond).size(), statistics.apart[0].key_frames);
  EXPECT_EQ(slam->landmark_positions().size(), statistics.landmarks);
  ASSERT_TRUE(slam->save_map(folder / "main.map").ok());
  ASSERT_TRUE(slam->save_map(folder / "apart.map", kSecond).ok());
  EXPECT_EQ(read_map(folder / "main.map")->landmark_positions(), slam->landmark_positions());
  EXPECT_EQ(read_map(folder / "apart.map")->landmark_positions(), slam->landmark_positions(kSecond));
}

TEST_P(SubMapTest, TheOneWithMostFramesIsTheMainOne) {
  const auto slam = make();
  go(*slam, kLeft, kLeft + 0.2);
  cover_the_lens(*slam);
  (void)look_around(*slam, kRight);
  const SE3 first = truth.back();
  go(*slam, kRight, kRight - 0.4);
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_EQ(slam->statistics().sub_map, kSecond);
  expect_truth(slam->trajectory(), first, slam->statistics().tracked);
  EXPECT_EQ(slam->trajectory(kFirst).size(), 5u);
}

TEST_P(SubMapTest, InASavedMapARunMayBeginApartFromIt) {
  const auto mapped = make();
  go(*mapped, kLeft, 0);
  ASSERT_TRUE(mapped->finish().ok());
  ASSERT_TRUE(mapped->save_map(folder / "wall.map").ok());
  Config config;
  config.deterministic = GetParam();
  for (const bool frozen : {false, true}) {
    config.mapping.frozen = frozen;
    const auto slam = std::move(Slam::create(config, world.camera(), *read_map(folder / "wall.map"))).value();
    truth.clear();
    EXPECT_EQ(look_around(*slam, kRight), frozen ? 40 : kLostBefore);
    if (!frozen) {
      EXPECT_EQ(slam->statistics().tracked, 0u) << "in the saved map, which stays the main one";
      EXPECT_TRUE(slam->trajectory().empty());
      go(*slam, kRight, -0.6);
    }
    ASSERT_TRUE(slam->finish().ok());
    const SlamStatistics statistics = slam->statistics();
    EXPECT_EQ(statistics.sub_maps_begun, frozen ? 0u : 1u);
    EXPECT_EQ(statistics.sub_maps_joined, frozen ? 0u : 1u);
    expect_truth(slam->trajectory(), at(kLeft), frozen ? 0 : truth.size() - kLostBefore);
  }
}

TEST_P(SubMapTest, WithoutThemALostCameraStaysLost) {
  Config config;
  config.mapping.sub_maps.enabled = false;
  const auto slam = make(config);
  go(*slam, kLeft, 0);
  cover_the_lens(*slam);
  EXPECT_EQ(look_around(*slam, kRight), 40);
  EXPECT_EQ(slam->statistics().sub_maps_begun, 0u);
}

TEST_P(SubMapTest, NothingBeginsWhereTooLittleIsSeen) {
  const auto slam = make();
  go(*slam, kLeft, 0);
  cover_the_lens(*slam, 60);
  EXPECT_EQ(look_around(*slam, 0), 0) << "uncovered where it was, it is found at once";
  EXPECT_EQ(slam->statistics().sub_maps_begun, 0u);
}

INSTANTIATE_TEST_SUITE_P(Schedulers, SubMapTest, ::testing::Bool(),
                         [](const auto& scheduler) { return scheduler.param ? "deterministic" : "threaded"; });

}  // namespace
}  // namespace semvslam
