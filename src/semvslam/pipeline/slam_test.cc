#include "semvslam/pipeline/slam.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "semvslam/geometry/alignment.h"
#include "semvslam/tracking/plane_world_testing.h"

namespace semvslam {
namespace {

using testing::PlaneWorld;

std::unique_ptr<Slam> make_slam(const PlaneWorld& world, bool deterministic, Config config = {}) {
  config.deterministic = deterministic;
  Result<std::unique_ptr<Slam>> slam = Slam::create(config, world.camera());
  EXPECT_TRUE(slam.ok());
  return std::move(slam).value();
}

/// The absolute trajectory error after rigid alignment stays below one percent of the way.
void expect_truth(const Trajectory& trajectory) {
  std::vector<Eigen::Vector3d> truth, estimate;
  double way_m = 0;
  for (const StampedPose& pose : trajectory) {
    const auto frame = static_cast<int>(std::lround(pose.stamp.seconds() * 30));
    truth.push_back(PlaneWorld::world_from_camera(frame).translation());
    estimate.push_back(pose.world_from_camera.translation());
    if (truth.size() > 1) way_m += (truth[truth.size() - 1] - truth[truth.size() - 2]).norm();
  }
  const Result<Alignment> alignment = align_points(truth, estimate, false);
  ASSERT_TRUE(alignment.ok());
  EXPECT_LT(alignment->rmse_m, 0.01 * way_m);
}

constexpr int kFrames = 40;

class SlamTest : public ::testing::TestWithParam<bool> {
 protected:
  PlaneWorld world;
};

TEST_P(SlamTest, EveryFrameIsTrackedAndTheMapIsConsistent) {
  const auto slam = make_slam(world, GetParam());
  for (int i = 0; i < kFrames; ++i) {
    const Result<TrackResult> result = slam->process(world.render(i));
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->state, TrackingState::kTracking) << "frame " << i;
    EXPECT_EQ(result->frame.value, static_cast<std::uint32_t>(i));
  }
  ASSERT_TRUE(slam->finish().ok());
  const Status invariants = slam->check_invariants();
  EXPECT_TRUE(invariants.ok()) << invariants.error().message;
  ASSERT_EQ(slam->trajectory().size(), static_cast<std::size_t>(kFrames));
  expect_truth(slam->trajectory());
  const SlamStatistics statistics = slam->statistics();
  EXPECT_EQ(statistics.frames, static_cast<std::uint64_t>(kFrames));
  EXPECT_EQ(statistics.tracked, static_cast<std::uint64_t>(kFrames));
  EXPECT_EQ(statistics.lost, 0u);
  EXPECT_GT(statistics.key_frames, 1u);
  EXPECT_EQ(slam->landmark_positions().size(), statistics.landmarks);
}

TEST_P(SlamTest, FramesThatDoNotFitAreRefusedAndTheRunGoesOn) {
  const auto slam = make_slam(world, GetParam());
  ASSERT_TRUE(slam->process(world.render(0)).ok());
  RgbdFrame small = world.render(1);
  small.gray = small.gray(cv::Rect(0, 0, 100, 100)).clone();
  const Result<TrackResult> refused = slam->process(small);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("320x240"), std::string::npos) << refused.error().message;
  RgbdFrame wrong_depth = world.render(1);
  wrong_depth.depth.convertTo(wrong_depth.depth, CV_8UC1);
  EXPECT_FALSE(slam->process(wrong_depth).ok());
  RgbdFrame again = world.render(1);
  again.stamp = world.render(0).stamp;
  const Result<TrackResult> not_later = slam->process(again);
  ASSERT_FALSE(not_later.ok());
  EXPECT_NE(not_later.error().message.find("not later"), std::string::npos) << not_later.error().message;
  RgbdFrame wrong_mask = world.render(1);
  wrong_mask.mask = cv::Mat::zeros(10, 10, CV_8UC1);
  EXPECT_FALSE(slam->process(wrong_mask).ok());
  const Result<TrackResult> next = slam->process(world.render(1));
  ASSERT_TRUE(next.ok());
  EXPECT_EQ(next->state, TrackingState::kTracking);
  EXPECT_EQ(slam->statistics().frames, 2u);
}

TEST_P(SlamTest, DarkFramesAreCountedLostAndTrackingComesBack) {
  const auto slam = make_slam(world, GetParam());
  for (int i = 0; i < 20; ++i) {
    RgbdFrame frame = world.render(i);
    if (i >= 10 && i < 13) frame.gray.setTo(0);
    ASSERT_TRUE(slam->process(frame).ok());
  }
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_EQ(slam->statistics().lost, 3u);
  EXPECT_EQ(slam->trajectory().size(), 17u);
  expect_truth(slam->trajectory());
}

TEST_P(SlamTest, ALostCameraIsFoundFarFromWhereItGotLost) {
  // Along the wall, farther than an image is wide; then the camera is carried back with its eyes shut.
  const auto at = [](int i) { return SE3(Eigen::Quaterniond::Identity(), {-1.2 + 0.06 * i, 0, 0}); };
  constexpr int kWay = 40;
  const auto slam = make_slam(world, GetParam());
  for (int i = 0; i <= kWay; ++i) ASSERT_TRUE(slam->process(world.render(at(i), i)).ok());
  RgbdFrame dark = world.render(at(kWay), kWay + 1);
  dark.gray.setTo(0);
  EXPECT_EQ(slam->process(dark)->state, TrackingState::kLost);
  EXPECT_EQ(slam->process(world.render(at(1), kWay + 2))->state, TrackingState::kLost);  // and looked for
  for (int i = 2; i < 8; ++i) {
    const Result<TrackResult> result = slam->process(world.render(at(i), kWay + 1 + i));
    ASSERT_TRUE(result.ok());
    ASSERT_EQ(result->state, TrackingState::kTracking);
    EXPECT_NEAR(result->world_from_camera.translation().x(), 0.06 * i, 0.01);
  }
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_EQ(slam->statistics().relocalised, 1u);
  EXPECT_EQ(slam->statistics().lost, 2u);
  EXPECT_TRUE(slam->check_invariants().ok());
}

TEST_P(SlamTest, ALostCameraThatIsNowhereStaysLostAndIsNotLookedForInEveryFrame) {
  Config config;
  config.mapping.sub_maps.enabled = false;
  const auto slam = make_slam(world, GetParam(), config);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(slam->process(world.render(i)).ok());
  RgbdFrame elsewhere = world.render(10);
  cv::randu(elsewhere.gray, 0, 255);
  cv::GaussianBlur(elsewhere.gray, elsewhere.gray, {}, 1.5);
  cv::normalize(elsewhere.gray, elsewhere.gray, 0, 255, cv::NORM_MINMAX);
  for (int i = 10; i < 30; ++i) {
    elsewhere.stamp = TimeStamp{i * 33'333'333LL};
    EXPECT_EQ(slam->process(elsewhere)->state, TrackingState::kLost);
  }
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_EQ(slam->statistics().relocalised, 0u);
  const SlamStatistics statistics = slam->statistics();
  const auto stage = std::find_if(statistics.stages.begin(), statistics.stages.end(),
                                  [](const StageSummary& s) { return s.name == "mapping.relocalise"; });
  ASSERT_NE(stage, statistics.stages.end());
  EXPECT_EQ(stage->count, 8u);  // of 20: the first five, then every fifth
}

TEST_P(SlamTest, QueriesFromAnotherThreadSeeConsistentStates) {
  const auto slam = make_slam(world, GetParam());
  ASSERT_TRUE(slam->process(world.render(0)).ok());
  std::jthread reader([&](std::stop_token stop) {
    while (!stop.stop_requested()) {
      const std::size_t poses = slam->trajectory().size();
      EXPECT_LE(slam->key_frame_trajectory().size(), poses);
      EXPECT_TRUE(slam->check_invariants().ok());
      EXPECT_GE(slam->statistics().frames, poses);
    }
  });
  for (int i = 1; i < 25; ++i) ASSERT_TRUE(slam->process(world.render(i)).ok());
  ASSERT_TRUE(slam->finish().ok());
}

TEST_P(SlamTest, ItCanBeDroppedAtAnyMomentAndFinishedTwice) {
  const auto dropped = make_slam(world, GetParam());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(dropped->process(world.render(i)).ok());
  const auto unused = make_slam(world, GetParam());
  EXPECT_TRUE(unused->finish().ok());
  EXPECT_TRUE(unused->finish().ok());
  EXPECT_TRUE(unused->trajectory().empty());
}

INSTANTIATE_TEST_SUITE_P(Schedulers, SlamTest, ::testing::Bool(),
                         [](const auto& scheduler) { return scheduler.param ? "deterministic" : "threaded"; });

TEST(Slam, InRealTimeALostCameraIsFoundByALaterFrame) {
  const PlaneWorld world;
  const auto at = [](int i) { return SE3(Eigen::Quaterniond::Identity(), {-1.2 + 0.06 * i, 0, 0}); };
  Config config;
  config.realtime = true;
  const auto slam = std::move(Slam::create(config, world.camera())).value();
  int stamp = 0;
  const auto next_like = [&](RgbdFrame frame) {
    frame.stamp = TimeStamp{stamp++ * 33'333'333LL};
    return slam->process(frame);
  };
  // Nothing waits for mapping here: four frames to a step, so that the map gets there.
  for (int i = 0; i <= 40; ++i) {
    const RgbdFrame frame = world.render(at(i), 0);
    for (int k = 0; k < 4; ++k) ASSERT_TRUE(next_like(frame).ok());
  }
  const RgbdFrame back = world.render(at(1), 0);
  TrackingState state = TrackingState::kLost;
  for (int i = 0; i < 500 && state != TrackingState::kTracking; ++i) {
    const Result<TrackResult> result = next_like(back);
    ASSERT_TRUE(result.ok());
    state = result->state;
    if (state == TrackingState::kTracking) {
      EXPECT_NEAR(result->world_from_camera.translation().x(), 0.06, 0.03);
    }
  }
  EXPECT_EQ(state, TrackingState::kTracking);
  ASSERT_TRUE(slam->finish().ok());
  EXPECT_GE(slam->statistics().relocalised, 1u);
}

TEST(Slam, DeterministicRunsAreByteIdentical) {
  const PlaneWorld world;
  std::vector<std::vector<Eigen::Vector3d>> landmarks;
  std::vector<Trajectory> trajectories;
  for (int run = 0; run < 2; ++run) {
    cv::setNumThreads(run == 0 ? 1 : 2);
    const auto slam = make_slam(world, true);
    for (int i = 0; i < kFrames; ++i) ASSERT_TRUE(slam->process(world.render(i)).ok());
    ASSERT_TRUE(slam->finish().ok());
    landmarks.push_back(slam->landmark_positions());
    trajectories.push_back(slam->trajectory());
  }
  EXPECT_EQ(landmarks[0], landmarks[1]);
  ASSERT_EQ(trajectories[0].size(), trajectories[1].size());
  for (std::size_t i = 0; i < trajectories[0].size(); ++i) {
    EXPECT_EQ(trajectories[0][i].world_from_camera.translation(), trajectories[1][i].world_from_camera.translation());
    EXPECT_EQ(trajectories[0][i].world_from_camera.rotation().coeffs(),
              trajectories[1][i].world_from_camera.rotation().coeffs());
  }
}

TEST(Slam, ACameraThatCannotBeIsRefused) {
  Camera camera = PlaneWorld().camera();
  camera.fx_px = -1;
  const Result<std::unique_ptr<Slam>> slam = Slam::create(Config{}, camera);
  ASSERT_FALSE(slam.ok());
  EXPECT_NE(slam.error().message.find("focal"), std::string::npos);
}

TEST(Slam, SinksReceiveEveryFrameInOrder) {
  struct Recorder : Sink {
    std::vector<std::uint32_t> frames;
    void on_frame(const RgbdFrame& frame, const TrackResult& result) override {
      EXPECT_EQ(frame.id, result.frame);
      frames.push_back(result.frame.value);
    }
  };
  const PlaneWorld world;
  const auto slam = make_slam(world, false);
  const auto recorder = std::make_shared<Recorder>();
  slam->add_sink(recorder);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(slam->process(world.render(i)).ok());
  EXPECT_EQ(recorder->frames, (std::vector<std::uint32_t>{0, 1, 2, 3}));
}

TEST(Config, EveryValueSurvivesBeingWrittenAndReadBack) {
  Config config;
  ConfigSchema schema = config.schema();
  ASSERT_TRUE(schema.set("tracking.key_frame_ratio=0.5").ok());
  ASSERT_TRUE(schema.set("mapping.local_map.nearby_key_frames=3").ok());
  const std::string text = schema.dump_yaml();
  Config copy;
  ConfigSchema copy_schema = copy.schema();
  const Status loaded = copy_schema.load_yaml(text, "copy");
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(copy_schema.dump_yaml(), text);
  EXPECT_EQ(copy.mapping.local_map.nearby_key_frames, 3);
  EXPECT_FALSE(schema.set("tracking.key_frame_ratoi=0.5").ok());
}

}  // namespace
}  // namespace semvslam
