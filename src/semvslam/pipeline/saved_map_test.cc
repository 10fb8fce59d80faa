#include "semvslam/pipeline/saved_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <numbers>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/map/map_file.h"
#include "semvslam/pipeline/slam.h"
#include "semvslam/tracking/plane_world_testing.h"

namespace semvslam {
namespace {

using ::testing::HasSubstr;
using testing::PlaneWorld;

/// Along the wall, farther than an image is wide; the first one is where the saved map has its origin.
SE3 first_way(int i) { return {Eigen::Quaterniond::Identity(), {-1.2 + 0.06 * i, 0, 0}}; }
constexpr int kFirstFrames = 41;

/// Back again on another way: beginning at the other end, higher, nearer and turned.
SE3 second_way(int i) {
  const double turned_rad = (4 - 0.2 * i) * std::numbers::pi / 180;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turned_rad, Eigen::Vector3d(0.3, 1, 0.2).normalized())),
          {0.9 - 0.05 * i, 0.07, 0.1 + 0.002 * i}};
}
constexpr int kSecondFrames = 36;

std::string content_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::uint64_t times_of(const SlamStatistics& statistics, const std::string& stage) {
  const auto at = std::ranges::find(statistics.stages, stage, &StageSummary::name);
  return at == statistics.stages.end() ? 0 : at->count;
}

class SavedMapTest : public ::testing::TestWithParam<bool> {
 protected:
  Config config(bool frozen) const {
    Config config;
    config.deterministic = GetParam();
    config.mapping.frozen = frozen;
    return config;
  }

  /// Maps the wall; @return the file.
  std::filesystem::path map_the_wall(int frames = kFirstFrames) {
    const auto slam = std::move(Slam::create(config(false), world.camera())).value();
    for (int i = 0; i < frames; ++i) EXPECT_TRUE(slam->process(world.render(first_way(i), i)).ok());
    EXPECT_TRUE(slam->finish().ok());
    const Status saved = slam->save_map(folder / "wall.map");
    EXPECT_TRUE(saved.ok()) << saved.error().message;
    return folder / "wall.map";
  }

  std::unique_ptr<Slam> begin_in(const std::filesystem::path& file, bool frozen) {
    Result<Map> map = read_map(file);
    EXPECT_TRUE(map.ok()) << map.error().message;
    Result<std::unique_ptr<Slam>> slam = Slam::create(config(frozen), world.camera(), std::move(*map));
    EXPECT_TRUE(slam.ok()) << slam.error().message;
    return std::move(slam).value();
  }

  /// Goes the second way: its first frame is looked for, all others are tracked, in the world of the saved map.
  void go_back(Slam& slam) {
    for (int i = 0; i < kSecondFrames; ++i) {
      const Result<TrackResult> result = slam.process(world.render(second_way(i), i));
      ASSERT_TRUE(result.ok());
      EXPECT_EQ(result->frame.value, static_cast<std::uint32_t>(i)) << "frames are counted from 0 in every session";
      ASSERT_EQ(result->state, i == 0 ? TrackingState::kLost : TrackingState::kTracking) << "frame " << i;
    }
    ASSERT_TRUE(slam.finish().ok());
    const SlamStatistics statistics = slam.statistics();
    EXPECT_EQ(statistics.relocalised, 1u);
    EXPECT_EQ(statistics.lost, 1u);
    const Trajectory trajectory = slam.trajectory();
    ASSERT_EQ(trajectory.size(), kSecondFrames - 1u) << "of this session alone";
    for (const StampedPose& pose : trajectory) {
      const auto i = static_cast<int>(std::lround(pose.stamp.seconds() * 30));
      const SE3 error = pose.world_from_camera.inverse() * (first_way(0).inverse() * second_way(i));
      EXPECT_LT(error.translation().norm(), 0.008) << "frame " << i;
      EXPECT_LT(error.rotation_angle_rad(), 0.006) << "frame " << i;
    }
  }

  const testing_support::TemporaryFolder folder;
  const PlaneWorld world;
};

TEST_P(SavedMapTest, ACameraIsLocalisedInItAndNothingInItChanges) {
  const std::filesystem::path file = map_the_wall();
  const auto slam = begin_in(file, true);
  go_back(*slam);
  EXPECT_TRUE(slam->key_frame_trajectory().empty());
  EXPECT_TRUE(slam->key_frame_masks().empty());
  const SlamStatistics statistics = slam->statistics();
  EXPECT_GT(statistics.key_frames, 3u);
  EXPECT_EQ(statistics.key_frames, statistics.loaded_key_frames);
  EXPECT_EQ(statistics.landmarks, statistics.loaded_landmarks);
  EXPECT_EQ(times_of(statistics, "mapping"), 0u);
  EXPECT_GT(times_of(statistics, "mapping.local_map"), 3u) << "the snapshot follows the camera";
  ASSERT_TRUE(slam->save_map(folder / "after.map").ok());
  EXPECT_EQ(content_of(folder / "after.map"), content_of(file));
}

TEST_P(SavedMapTest, MappingGoesOnInIt) {
  const std::filesystem::path file = map_the_wall();
  const auto slam = begin_in(file, false);
  go_back(*slam);
  EXPECT_TRUE(slam->check_invariants().ok());
  const SlamStatistics statistics = slam->statistics();
  EXPECT_GT(statistics.loaded_key_frames, 3u);
  const Trajectory key_frames = slam->key_frame_trajectory();
  EXPECT_GT(key_frames.size(), 0u);
  EXPECT_LT(key_frames.size(), statistics.key_frames);
  EXPECT_LT(key_frames.size(), static_cast<std::size_t>(kSecondFrames));

  // And again, in what both have made.
  ASSERT_TRUE(slam->save_map(folder / "both.map").ok());
  const auto third = begin_in(folder / "both.map", false);
  EXPECT_EQ(third->statistics().loaded_key_frames, statistics.key_frames);
  go_back(*third);
}

TEST_P(SavedMapTest, AForeignPlaceIsNotFoundAndLeavesItAlone) {
  const std::filesystem::path file = map_the_wall();
  const PlaneWorld elsewhere(8);
  for (const bool frozen : {false, true}) {
    const auto slam = begin_in(file, frozen);
    for (int i = 0; i < 12; ++i)
      EXPECT_EQ(slam->process(elsewhere.render(second_way(i), i))->state, TrackingState::kLost);
    ASSERT_TRUE(slam->finish().ok());
    EXPECT_EQ(slam->statistics().tracked, 0u);
    EXPECT_TRUE(slam->trajectory().empty());
    EXPECT_EQ(times_of(slam->statistics(), "mapping.relocalise"), 6u) << "five frames, then every fifth";
    ASSERT_TRUE(slam->save_map(folder / "after.map").ok());
    EXPECT_EQ(content_of(folder / "after.map"), content_of(file));
  }
}

TEST_P(SavedMapTest, OffTheMapALocalisedCameraIsLostAfterASecondAndFoundWhenItIsBack) {
  const auto slam = begin_in(map_the_wall(20), true);
  // On along the wall, to where nobody has been, a pause there, and back. Neighbouring frames always see the same.
  constexpr int kWay = 44, kBack = 90;
  const auto at = [&](int i) {
    const int steps = i < kBack ? std::min(i, kWay) : kWay - (i - kBack);
    return SE3(Eigen::Quaterniond::Identity(), {-0.1 + 0.05 * steps, 0, 0});
  };
  std::vector<TrackingState> states;
  for (int i = 0; i <= kBack + kWay; ++i) states.push_back(slam->process(world.render(at(i), i))->state);
  for (int i = 1; i < kWay; ++i) EXPECT_EQ(states[static_cast<std::size_t>(i)], TrackingState::kTracking) << i;
  EXPECT_EQ(states[kBack - 1], TrackingState::kLost);
  EXPECT_EQ(states.back(), TrackingState::kTracking);
  const SE3 error = slam->trajectory().back().world_from_camera.inverse() * (first_way(0).inverse() * at(kBack + kWay));
  EXPECT_LT(error.translation().norm(), 0.008);
}

INSTANTIATE_TEST_SUITE_P(Schedulers, SavedMapTest, ::testing::Bool(),
                         [](const auto& scheduler) { return scheduler.param ? "deterministic" : "threaded"; });

class SavedMapInputTest : public SavedMapTest {};

class SavedMapRealTimeTest : public ::testing::Test {
 protected:
  const testing_support::TemporaryFolder folder;
  const PlaneWorld world;
};

TEST_P(SavedMapInputTest, DeterministicSessionsInItAreByteIdentical) {
  const std::filesystem::path file = map_the_wall();
  for (const bool frozen : {false, true}) {
    std::vector<Trajectory> trajectories;
    std::vector<std::string> maps;
    for (int run = 0; run < 2; ++run) {
      const auto slam = begin_in(file, frozen);
      go_back(*slam);
      trajectories.push_back(slam->trajectory());
      ASSERT_TRUE(slam->save_map(folder / "after.map").ok());
      maps.push_back(content_of(folder / "after.map"));
    }
    EXPECT_EQ(maps[0], maps[1]);
    ASSERT_EQ(trajectories[0].size(), trajectories[1].size());
    for (std::size_t i = 0; i < trajectories[0].size(); ++i)
      EXPECT_EQ(trajectories[0][i].world_from_camera.translation(), trajectories[1][i].world_from_camera.translation());
  }
}

TEST_P(SavedMapInputTest, WhatDoesNotFitIsRefused) {
  const std::filesystem::path file = map_the_wall();
  const auto fault = [&](const Config& used, const Camera& camera) {
    const Result<std::unique_ptr<Slam>> slam = Slam::create(used, camera, std::move(*read_map(file)));
    return slam ? "" : slam.error().message;
  };
  EXPECT_EQ(fault(config(false), world.camera()), "");
  Camera camera = world.camera();
  camera.fx_px *= 1.001;
  EXPECT_EQ(fault(config(false), camera), "") << "a calibration that is a little off";
  camera.fx_px *= 1.02;
  EXPECT_THAT(fault(config(true), camera), HasSubstr("saved map: its camera (320x240, fx 260.00"));
  camera = world.camera();
  camera.width_px = 640;
  EXPECT_THAT(fault(config(true), camera), HasSubstr("is not the recording's (640x240"));
  Config other = config(true);
  other.orb.levels = 7;
  EXPECT_THAT(fault(other, world.camera()), HasSubstr("orb.levels"));
  other = config(true);
  other.orb.scale_factor = 1.25;
  EXPECT_THAT(fault(other, world.camera()), HasSubstr("orb.scale_factor"));
  const Result<std::unique_ptr<Slam>> nowhere = Slam::create(config(true), world.camera());
  ASSERT_FALSE(nowhere.ok());
  EXPECT_THAT(nowhere.error().message, HasSubstr("no saved map to localise in"));
}

TEST_P(SavedMapInputTest, AnEmptyMapIsNeitherSavedNorBegunIn) {
  const auto slam = std::move(Slam::create(config(false), world.camera())).value();
  ASSERT_TRUE(slam->finish().ok());
  const Status saved = slam->save_map(folder / "empty.map");
  ASSERT_FALSE(saved.ok());
  EXPECT_THAT(saved.error().message, HasSubstr("empty.map: not written, the map is empty"));
  EXPECT_FALSE(std::filesystem::exists(folder / "empty.map"));
  const auto model = std::make_shared<ObservationModel>(world.camera(), NoiseModel{}, level_scales(OrbOptions{}));
  const Result<std::unique_ptr<Slam>> begun = Slam::create(config(false), world.camera(), Map(model));
  ASSERT_FALSE(begun.ok());
  EXPECT_THAT(begun.error().message, HasSubstr("no key frames"));
}

INSTANTIATE_TEST_SUITE_P(Schedulers, SavedMapInputTest, ::testing::Values(true),
                         [](const auto&) { return "deterministic"; });

TEST_F(SavedMapRealTimeTest, ItIsFoundByALaterFrameAndTheSnapshotFollows) {
  Config config;
  const auto mapped = std::move(Slam::create(config, world.camera())).value();
  for (int i = 0; i < kFirstFrames; ++i) ASSERT_TRUE(mapped->process(world.render(first_way(i), i)).ok());
  ASSERT_TRUE(mapped->finish().ok());
  ASSERT_TRUE(mapped->save_map(folder / "wall.map").ok());
  config.realtime = true;
  config.mapping.frozen = true;
  const auto slam = std::move(Slam::create(config, world.camera(), std::move(*read_map(folder / "wall.map")))).value();
  // Nothing waits for mapping here: the camera stands still until it is found, then ten frames to a step.
  int stamp = 0;
  TrackingState state = TrackingState::kLost;
  for (int i = 0; i < kSecondFrames; ++i) {
    RgbdFrame frame = world.render(second_way(i), 0);
    for (int k = 0; k < (i == 0 ? 500 : 10) && (i > 0 || state != TrackingState::kTracking); ++k) {
      frame.stamp = TimeStamp{stamp++ * 33'333'333LL};
      const Result<TrackResult> result = slam->process(frame);
      ASSERT_TRUE(result.ok());
      state = result->state;
      if (state != TrackingState::kTracking) continue;
      const SE3 error = result->world_from_camera.inverse() * (first_way(0).inverse() * second_way(i));
      EXPECT_LT(error.translation().norm(), 0.01) << "step " << i;
    }
    ASSERT_EQ(state, TrackingState::kTracking) << "step " << i;
  }
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_GT(times_of(slam->statistics(), "mapping.local_map"), 0u);
}

}  // namespace
}  // namespace semvslam
