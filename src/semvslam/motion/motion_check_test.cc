#include "semvslam/motion/motion_check.h"

#include <gtest/gtest.h>

#include <functional>

#include "semvslam/motion/motion_test_support.h"

namespace semvslam {
namespace {

using motion_testing::rotation;
using motion_testing::Shares;
using motion_testing::shares_of;
using motion_testing::TrackWorld;
using motion_testing::translation;

enum class Pose { kEstimated, kGiven };

// Shows the world to a fresh MotionCheck for `frames` frames; the camera moves by `step` from each to the next.
MotionCheckResult watch(TrackWorld& world, int frames, const SE3& step, Pose pose = Pose::kEstimated, bool hint = true,
                        const MotionCheckOptions& options = {}) {
  MotionCheck check(world.camera, options, {}, {});
  MotionCheckResult result;
  SE3 camera_from_world;
  for (int k = 0; k < frames; ++k) {
    world.see(k, camera_from_world);
    MotionFrame frame = world.frame_of(k);
    if (pose == Pose::kGiven) frame.camera_from_world = camera_from_world;
    if (hint) frame.cur_from_prev = step;
    result = check.step(frame, world.tracks);
    camera_from_world = step * camera_from_world;
  }
  return result;
}

const SE3 kSideways = translation(-0.01, 0, 0);  // 0.3 m/s at 30 Hz

TEST(MotionCheck, FindsNothingWhereNothingMoves) {
  TrackWorld world;
  const MotionCheckResult result = watch(world, 12, kSideways * rotation(0, 0.01, 0.002));
  EXPECT_EQ(result.moving, 0);
  EXPECT_GT(shares_of(world, result, 0).at_rest, 0.97);
  EXPECT_EQ(result.camera.source, CameraMotionSource::kEstimated);
}

TEST(MotionCheck, SeesAThingThatCrossesTheView) {
  TrackWorld world;
  world.add_thing({200, 150, 120, 160}, 2.0, {0, 0.4, 0}, 40);
  const MotionCheckResult result = watch(world, 8, kSideways);
  EXPECT_GT(shares_of(world, result, 1).moving, 0.97);
  EXPECT_LT(shares_of(world, result, 0).moving, 0.01);
  for (std::size_t i = 0; i < world.tracks.size(); ++i)
    if (world.groups[i] == 1 && result.tracks[i].verdict == MotionVerdict::kMoving) {
      EXPECT_NEAR(result.tracks[i].velocity_m_s.y(), 0.4, 0.1);
    }
}

TEST(MotionCheck, SeesATenthOfAMetrePerSecond) {
  TrackWorld world;
  world.add_thing({260, 180, 120, 100}, 1.5, {0.07, 0.08, 0}, 30);
  const MotionCheckResult result = watch(world, 12, kSideways);
  EXPECT_GT(shares_of(world, result, 1).moving, 0.9);
  EXPECT_LT(shares_of(world, result, 0).moving, 0.01);
}

TEST(MotionCheck, PeopleFillSixtyPercentOfThePoints) {
  TrackWorld world(120);
  // Two big near things with one common motion: the largest rigid consensus by points is theirs.
  world.add_thing({0, 0, 250, 470}, 1.5, {0.5, 0, 0}, 90);
  world.add_thing({330, 0, 140, 470}, 1.5, {0.5, 0, 0}, 90);
  const MotionCheckResult result = watch(world, 8, kSideways);
  EXPECT_GT(shares_of(world, result, 1).moving, 0.95);
  EXPECT_LT(shares_of(world, result, 0).moving, 0.05);
}

TEST(MotionCheck, PureRotationHasNoEpipolarLinesButVerdicts) {
  TrackWorld world;
  world.add_thing({260, 180, 120, 100}, 2.0, {0, 0.4, 0}, 30);
  const MotionCheckResult result = watch(world, 8, rotation(0.002, 0.012, 0));
  EXPECT_EQ(result.fundamental.state, FundamentalState::kHomography);
  EXPECT_GT(shares_of(world, result, 1).moving, 0.95);
  EXPECT_LT(shares_of(world, result, 0).moving, 0.01);
}

TEST(MotionCheck, NearlyStillCameraHasNoEpipolarLinesButVerdicts) {
  TrackWorld world;
  world.add_thing({260, 180, 120, 100}, 2.0, {0.3, 0, 0}, 30);
  const MotionCheckResult result = watch(world, 8, translation(0.0002, 0, 0));
  EXPECT_EQ(result.fundamental.state, FundamentalState::kStill);
  EXPECT_GT(shares_of(world, result, 1).moving, 0.95);
  EXPECT_EQ(shares_of(world, result, 0).moving, 0);
}

TEST(MotionCheck, MotionAlongTheEpipolarLineIsSeenByPositionAndDepth) {
  TrackWorld world;
  // The camera moves along x, and so does the thing: it stays on its epipolar lines.
  world.add_thing({260, 180, 120, 100}, 2.0, {-0.35, 0, 0}, 30);
  const MotionCheckResult result = watch(world, 8, kSideways, Pose::kGiven);
  ASSERT_TRUE(result.fundamental.usable());
  int on_line = 0, moving = 0;
  for (std::size_t i = 0; i < world.tracks.size(); ++i) {
    if (world.groups[i] != 1) continue;
    on_line += result.tracks[i].epipolar_px < MotionCheckOptions().epipolar_px;
    moving += result.tracks[i].verdict == MotionVerdict::kMoving;
  }
  EXPECT_GT(on_line, 25);  // the paper's test sees nothing
  EXPECT_GT(moving, 28);
}

TEST(MotionCheck, MotionTowardsTheCameraIsSeenByDepthAlone) {
  TrackWorld world;
  // On the axis of view a point that comes straight nearer keeps its pixel.
  for (int i = 0; i < 20; ++i)
    world.add_at({319.5 + (i % 5 - 2) * 3.0, 239.5 + (i / 5 - 2) * 3.0}, 1.6, {0, 0, -0.9}, 1);
  const MotionCheckResult result = watch(world, 10, SE3(), Pose::kGiven);
  const Shares shares = shares_of(world, result, 1);
  EXPECT_GT(shares.moving, 0.9);
  int nearer = 0;
  for (std::size_t i = 0; i < world.tracks.size(); ++i)
    nearer += world.groups[i] == 1 && result.tracks[i].reason == MotionReason::kNearer;
  EXPECT_GT(nearer, 15);
}

TEST(MotionCheck, WithoutDepthTheEpipolarLineDecides) {
  TrackWorld world;
  world.depth_measured = false;
  world.add_thing({260, 180, 120, 100}, 2.0, {0, 0.5, 0}, 30);
  const MotionCheckResult result = watch(world, 8, kSideways, Pose::kEstimated, false);
  EXPECT_EQ(result.camera.source, CameraMotionSource::kNone);
  ASSERT_TRUE(result.fundamental.usable());
  EXPECT_GT(shares_of(world, result, 1).moving, 0.9);
  EXPECT_LT(shares_of(world, result, 0).moving, 0.02);
  EXPECT_GT(shares_of(world, result, 0).unknown, 0.9);  // being on the line proves no rest
}

TEST(MotionCheck, WithoutDepthButWithPoseThePossiblePlacesDecide) {
  TrackWorld world;
  world.depth_measured = false;
  world.add_thing({260, 180, 120, 100}, 2.0, {0, 0.5, 0}, 30);
  // Rotation leaves no epipolar line, but one place where a point at rest must be.
  const MotionCheckResult result = watch(world, 8, rotation(0, 0.01, 0), Pose::kGiven);
  EXPECT_FALSE(result.fundamental.usable());
  EXPECT_GT(shares_of(world, result, 1).moving, 0.95);
  EXPECT_EQ(shares_of(world, result, 0).moving, 0);
}

TEST(MotionCheck, BentDepthMovesNothing) {
  TrackWorld world;
  world.depth_bend_share = 0.005;
  const MotionCheckResult result = watch(world, 12, translation(-0.012, 0.002, -0.01) * rotation(0, 0.015, 0));
  EXPECT_LT(shares_of(world, result, 0).moving, 0.005);
  EXPECT_GT(shares_of(world, result, 0).at_rest, 0.95);
}

TEST(MotionCheck, ExcludedTracksSayNothingOfTheCamera) {
  TrackWorld world(60);
  world.add_thing({100, 0, 440, 479}, 1.5, {0.6, 0, 0}, 240);
  MotionCheck check(world.camera, {}, {}, {});
  MotionCheckResult result;
  SE3 camera_from_world;
  for (int k = 0; k < 6; ++k) {
    world.see(k, camera_from_world);
    std::vector<FlowTrack> tracks;
    for (std::size_t i = 0; i < world.tracks.size(); ++i) {
      FlowTrack track(world.tracks[i].id());
      for (int age = world.tracks[i].size() - 1; age >= 0; --age) {
        TrackSample sample = world.tracks[i].sample(age);
        sample.excluded = world.groups[i] == 1;
        track.push(sample);
      }
      tracks.push_back(track);
    }
    result = check.step(world.frame_of(k), tracks);  // no hint at all
    camera_from_world = kSideways * camera_from_world;
  }
  ASSERT_EQ(result.camera.source, CameraMotionSource::kEstimated);
  EXPECT_LT((result.camera.cur_from_prev.translation() - kSideways.translation()).norm(), 0.003);
}

TEST(MotionCheck, AnEmptyFrameIsNoFault) {
  MotionCheck check(motion_testing::test_camera(), {}, {}, {});
  MotionFrame frame;
  for (std::uint32_t k = 0; k < 3; ++k) {
    frame.id = FrameId(k);
    const MotionCheckResult result = check.step(frame, {});
    EXPECT_TRUE(result.tracks.empty());
    EXPECT_EQ(result.camera.source, CameraMotionSource::kNone);
  }
}

TEST(MotionCheck, PosesOfTheCallerReplaceItsOwnWithoutAJump) {
  TrackWorld world;
  MotionCheck check(world.camera, {}, {}, {});
  const SE3 elsewhere = rotation(0.3, 1.0, 0.2) * translation(5, -2, 1);  // the caller's world is another one
  MotionCheckResult result;
  SE3 camera_from_world;
  for (int k = 0; k < 10; ++k) {
    world.see(k, camera_from_world);
    result = check.step(world.frame_of(k), world.tracks);
    if (k >= 5) check.set_pose(world.frame_of(k).id, camera_from_world * elsewhere);
    EXPECT_EQ(result.moving, 0) << "frame " << k;
    camera_from_world = kSideways * camera_from_world;
  }
}

TEST(MotionCheck, SameInputSameVerdicts) {
  const auto verdicts = [] {
    TrackWorld world;
    world.add_thing({260, 180, 120, 100}, 2.0, {0.3, 0.2, 0}, 30);
    const MotionCheckResult result = watch(world, 8, kSideways);
    std::vector<float> all;
    for (const TrackMotion& motion : result.tracks) {
      all.push_back(static_cast<float>(motion.verdict));
      all.push_back(motion.reprojection_px);
    }
    return all;
  };
  EXPECT_EQ(verdicts(), verdicts());
}

}  // namespace
}  // namespace semvslam
