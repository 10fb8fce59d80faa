#include "semvslam/motion/moving_regions.h"

#include <gtest/gtest.h>

#include "semvslam/motion/motion_test_support.h"

namespace semvslam {
namespace {

using motion_testing::test_camera;

constexpr float kWallM = 3.f, kThingM = 1.5f;

// A box before a wall, seen by a camera at rest: depth image, tracks on both, and the verdicts as they should be.
class BoxScene {
 public:
  explicit BoxScene(const MovingRegionOptions& options = {}) : regions(test_camera(), options, {}) {
    for (int y = 20; y < 470; y += 30)
      for (int x = 20; x < 630; x += 30) add(cv::Point2f(static_cast<float>(x), static_cast<float>(y)), false);
    for (int y = 10; y < 150; y += 22)
      for (int x = 10; x < 110; x += 22) add(cv::Point2f(static_cast<float>(x), static_cast<float>(y)), true);
  }

  /// One frame with the box's upper left corner there. @param moves what the verdicts on its points say.
  void show(int left, bool moves) {
    box = cv::Rect(left, 150, 120, 160);
    MotionFrame frame;
    frame.id = FrameId(static_cast<std::uint32_t>(index));
    frame.time_s = index / 30.0;
    frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(kWallM));
    frame.depth(box & cv::Rect(0, 0, 640, 480)).setTo(kThingM);
    frame.instances = instances;
    frame.excluded = excluded;
    MotionCheckResult result;
    result.camera.source = CameraMotionSource::kEstimated;
    std::vector<FlowTrack> seen;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      TrackSample sample;
      const bool on_box = on_box_[i];
      const cv::Point2f at =
          on_box ? start_[i] + cv::Point2f(static_cast<float>(box.x), static_cast<float>(box.y)) : start_[i];
      sample.pixel = sample.ideal = {at.x, at.y};
      sample.depth_m = on_box ? kThingM : kWallM;
      tracks[i].push(sample);
      if (!on_box && box.contains(at)) continue;  // hidden
      seen.push_back(tracks[i]);
      TrackMotion motion;
      motion.id = tracks[i].id();
      const bool moving = (on_box && moves) || std::find(wrong.begin(), wrong.end(), i) != wrong.end();
      motion.verdict = moving ? MotionVerdict::kMoving : MotionVerdict::kStatic;
      motion.reason = moving ? MotionReason::kReprojection : MotionReason::kNone;
      moving_frames_[i] = moving ? moving_frames_[i] + 1 : 0;
      motion.moving_frames = moving_frames_[i];
      if (moving) motion.velocity_m_s = {0.3f, 0, 0};
      result.tracks.push_back(motion);
    }
    regions.step(frame, seen, result);
    ++index;
  }
  double recall() const {
    return static_cast<double>(cv::countNonZero(regions.mask()(box))) / static_cast<double>(box.area());
  }
  int outside() const { return cv::countNonZero(regions.mask()) - cv::countNonZero(regions.mask()(box)); }

  MovingRegions regions;
  cv::Rect box;
  cv::Mat instances, excluded;
  std::vector<std::size_t> wrong;  // tracks with a false verdict
  std::vector<FlowTrack> tracks;
  int index = 0;

 private:
  void add(const cv::Point2f& at, bool on_box) {
    tracks.emplace_back(PointTrackId(static_cast<std::uint32_t>(tracks.size())));
    start_.push_back(at);
    on_box_.push_back(on_box);
    moving_frames_.push_back(0);
  }
  std::vector<cv::Point2f> start_;
  std::vector<bool> on_box_;
  std::vector<int> moving_frames_;
};

TEST(MovingRegions, AMovingThingGetsItsMask) {
  BoxScene scene;
  for (int k = 0; k < 10; ++k) scene.show(200 + 4 * k, true);
  ASSERT_EQ(scene.regions.regions().size(), 1u);
  const MovingRegion& region = scene.regions.regions().front();
  EXPECT_EQ(region.state, RegionState::kMoving);
  EXPECT_NEAR(region.depth_m, kThingM, 0.01);
  EXPECT_GT(region.tracks, 20);
  EXPECT_GT(scene.recall(), 0.95);
  EXPECT_LT(scene.outside(), scene.box.area() / 10);
  EXPECT_EQ(region.mask.size(), region.window.size());
}

TEST(MovingRegions, StaysForItsTimeAndIsThenReleased) {
  MovingRegionOptions options;
  options.hold_s = 0.5;
  BoxScene scene(options);
  for (int k = 0; k < 8; ++k) scene.show(200 + 4 * k, true);
  for (int k = 0; k < 12; ++k) scene.show(228, false);
  ASSERT_EQ(scene.regions.regions().size(), 1u);
  EXPECT_EQ(scene.regions.regions().front().state, RegionState::kPaused);
  EXPECT_GT(scene.recall(), 0.8);
  // The depth looks five frames back: to it, the thing moved so much longer.
  for (int k = 0; k < 11; ++k) scene.show(228, false);
  EXPECT_TRUE(scene.regions.regions().empty());
  EXPECT_EQ(cv::countNonZero(scene.regions.mask()), 0);
}

TEST(MovingRegions, MovesAgainAtOnceUnderTheSameId) {
  BoxScene scene;
  for (int k = 0; k < 8; ++k) scene.show(200 + 4 * k, true);
  ASSERT_EQ(scene.regions.regions().size(), 1u);
  const RegionId id = scene.regions.regions().front().id;
  for (int k = 0; k < 15; ++k) scene.show(228, false);
  scene.show(232, true);
  ASSERT_EQ(scene.regions.regions().size(), 1u);
  EXPECT_EQ(scene.regions.regions().front().id, id);
  EXPECT_EQ(scene.regions.regions().front().state, RegionState::kMoving);
}

TEST(MovingRegions, ScatteredFalseVerdictsMakeNone) {
  BoxScene scene;
  scene.wrong = {3, 40, 77, 120, 160, 201};
  for (int k = 0; k < 10; ++k) scene.show(200, false);
  EXPECT_TRUE(scene.regions.regions().empty());
}

TEST(MovingRegions, FewFalseVerdictsAmongManyAtRestMakeNone) {
  BoxScene scene;
  scene.wrong = {0, 1, 2, 43, 44};  // close together on the wall, others at rest between them
  for (int k = 0; k < 10; ++k) scene.show(200, false);
  EXPECT_TRUE(scene.regions.regions().empty());
}

TEST(MovingRegions, KnownInstancesAndExcludedPixelsMakeNone) {
  for (const bool instance : {true, false}) {
    BoxScene scene;
    if (instance)
      scene.instances = cv::Mat(480, 640, CV_16UC1, cv::Scalar(1));
    else
      scene.excluded = cv::Mat(480, 640, CV_8UC1, cv::Scalar(255));
    for (int k = 0; k < 8; ++k) scene.show(200 + 4 * k, true);
    EXPECT_TRUE(scene.regions.regions().empty());
  }
}

TEST(MovingRegions, ForgetsOnReset) {
  BoxScene scene;
  for (int k = 0; k < 8; ++k) scene.show(200 + 4 * k, true);
  scene.regions.reset();
  EXPECT_TRUE(scene.regions.regions().empty());
  EXPECT_EQ(cv::countNonZero(scene.regions.mask()), 0);
}

TEST(GrowRegion, StopsAtTheEdgeOfDepthAndAtWhatRests) {
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(3.f));
  depth(cv::Rect(200, 100, 200, 200)).setTo(1.5f);
  const CellGrid grid(test_camera(), depth);
  const std::vector<GrowthSeed> seeds{{{220, 150}, 1.5f}, {{220, 250}, 1.5f}, {{250, 200}, 1.5f}};
  GrowthLimits limits;
  limits.margin_px = 300;
  const cv::Mat free = grow_region(grid, seeds, {}, limits);
  EXPECT_NEAR(cv::countNonZero(free), 50 * 50, 110);
  const std::vector<GrowthSeed> rest{{{380, 150}, 1.5f}, {{380, 250}, 1.5f}};
  const cv::Mat held = grow_region(grid, seeds, rest, limits);
  EXPECT_EQ(held.at<std::uint8_t>(200 / 4, 390 / 4), 0);
  EXPECT_EQ(held.at<std::uint8_t>(200 / 4, 260 / 4), 255);
}

TEST(GrowRegion, DoesNotFloodAFloor) {
  // A thing on a slanted floor whose depth touches the thing's at its foot.
  cv::Mat depth(480, 640, CV_32FC1);
  for (int y = 0; y < 480; ++y) depth.row(y).setTo(4.f - 0.005f * static_cast<float>(y));
  depth(cv::Rect(280, 200, 80, 120)).setTo(depth.at<float>(319, 300));
  const CellGrid grid(test_camera(), depth);
  std::vector<GrowthSeed> seeds;
  for (int y = 210; y < 320; y += 25)
    for (int x = 290; x < 360; x += 25)
      seeds.push_back({{static_cast<float>(x), static_cast<float>(y)}, depth.at<float>(319, 300)});
  GrowthLimits limits;
  const int taken = cv::countNonZero(grow_region(grid, seeds, {}, limits)) * CellGrid::kCellPx * CellGrid::kCellPx;
  EXPECT_GT(taken, 80 * 120 * 9 / 10);
  EXPECT_LT(taken, 80 * 120 * 17 / 10);
}

TEST(DepthSeeds, LieOnTheFrontOfASmoothThingThatMoves) {
  DepthSeeds seeds(test_camera(), {}, 8);
  std::vector<DepthSeed> found;
  for (int k = 0; k < 6; ++k) {
    cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(3.f));
    depth(cv::Rect(200 + 6 * k, 150, 120, 160)).setTo(1.5f);
    found = seeds.step(depth, SE3());
  }
  EXPECT_GT(found.size(), 20u);
  for (const DepthSeed& seed : found) {
    EXPECT_GE(seed.pixel.x, 320);  // what the box covers now and did not five frames ago
    EXPECT_LE(seed.pixel.x, 350);
    EXPECT_EQ(seed.depth_m, 1.5f);
  }
}

TEST(DepthSeeds, AreNotMadeByTheCamera) {
  DepthSeeds seeds(test_camera(), {}, 8);
  const Camera camera = test_camera();
  std::size_t found = 0;
  for (int k = 0; k < 8; ++k) {
    // The camera goes sideways past a box at rest: its edge wanders over the wall.
    const double x_m = 0.01 * k;
    cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(3.f));
    const int left = static_cast<int>(std::lround(250 - camera.fx_px * x_m / 1.5));
    depth(cv::Rect(left, 150, 120, 160)).setTo(1.5f);
    found += seeds.step(depth, motion_testing::translation(-0.01, 0, 0)).size();
  }
  EXPECT_EQ(found, 0u);
}

TEST(InstanceMotion, CountsVerdictsPerInstance) {
  std::vector<std::uint16_t> instances;
  std::vector<TrackMotion> motion;
  const auto add = [&](std::uint16_t instance, MotionVerdict verdict) {
    instances.push_back(instance);
    motion.push_back({});
    motion.back().verdict = verdict;
  };
  for (int i = 0; i < 3; ++i) add(1, MotionVerdict::kMoving);
  add(1, MotionVerdict::kStatic);
  add(1, MotionVerdict::kUnknown);
  add(2, MotionVerdict::kStatic);
  add(0, MotionVerdict::kMoving);
  add(9, MotionVerdict::kMoving);  // more than are asked for
  const std::vector<InstanceMotion> counts = count_instance_motion(motion, instances, 3);
  ASSERT_EQ(counts.size(), 3u);
  EXPECT_EQ(counts[0].moving, 3);
  EXPECT_EQ(counts[0].at_rest, 1);
  EXPECT_EQ(counts[0].unknown, 1);
  EXPECT_DOUBLE_EQ(counts[0].moving_share(), 0.75);
  EXPECT_EQ(counts[1].at_rest, 1);
  EXPECT_DOUBLE_EQ(counts[2].moving_share(), 0);
  EXPECT_THROW(count_instance_motion(motion, {}, 3), std::invalid_argument);
}

}  // namespace
}  // namespace semvslam
