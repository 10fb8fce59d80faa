#include "semvslam/tracking/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "semvslam/tracking/plane_world_testing.h"

namespace semvslam {
namespace {

using testing::PlaneWorld;

class TrackerTest : public ::testing::Test {
 protected:
  TrackerTest()
      : model(std::make_shared<ObservationModel>(world.camera(), NoiseModel{}, level_scales(OrbOptions{}))),
        map(model),
        tracker(TrackingOptions{}, OrbOptions{}, DynamicOptions{}, model) {}

  /// Maps the first frame the way mapping does: every feature with depth becomes a landmark.
  std::shared_ptr<const LocalMap> start() {
    return begin_map(tracker.step(world.render(0), nullptr, nullptr, true), SubMapId(0));
  }
  std::shared_ptr<const LocalMap> begin_map(const Tracker::Output& first, SubMapId sub_map) {
    EXPECT_TRUE(first.key_frame.has_value());
    const KeyFrameId id = map.add_key_frame(first.key_frame->frame, {}, SE3(), first.key_frame->features, sub_map);
    for (std::uint32_t i = 0; i < first.key_frame->features->size(); ++i)
      if (first.key_frame->features->has_depth(i))
        map.add_landmark(model->back_project(*first.key_frame->features, i), id, i);
    return make_local_map(map, id, LocalMapOptions{});
  }

  PlaneWorld world;
  std::shared_ptr<const ObservationModel> model;
  Map map;
  Tracker tracker;
};

TEST_F(TrackerTest, TheFirstFrameWithDepthBecomesAKeyFrameAtTheOrigin) {
  RgbdFrame blind = world.render(0);
  blind.depth.setTo(0);
  const Tracker::Output none = tracker.step(blind, nullptr, nullptr, true);
  EXPECT_EQ(none.state, TrackingState::kInitializing);
  EXPECT_FALSE(none.key_frame.has_value());
  const Tracker::Output first = tracker.step(world.render(0), nullptr, nullptr, true);
  EXPECT_EQ(first.state, TrackingState::kTracking);
  ASSERT_TRUE(first.key_frame.has_value());
  EXPECT_FALSE(first.key_frame->reference.valid());
}

TEST_F(TrackerTest, PosesFollowTheTruth) {
  const auto local = start();
  for (int i = 1; i <= 12; ++i) {
    const Tracker::Output out = tracker.step(world.render(i), nullptr, local, false);
    ASSERT_EQ(out.state, TrackingState::kTracking) << "frame " << i;
    const SE3 error = out.camera_from_world * PlaneWorld::world_from_camera(i);
    EXPECT_LT(error.translation().norm(), 0.002) << "frame " << i;
    EXPECT_LT(error.rotation_angle_rad(), 0.002) << "frame " << i;
    EXPECT_GT(out.inliers, 100);
  }
}

TEST_F(TrackerTest, AFrameWithoutFeaturesIsLostAndTheNextGoodOneIsFound) {
  const auto local = start();
  ASSERT_EQ(tracker.step(world.render(1), nullptr, local, false).state, TrackingState::kTracking);
  RgbdFrame dark = world.render(2);
  dark.gray.setTo(0);
  const Tracker::Output lost = tracker.step(dark, nullptr, local, true);
  EXPECT_EQ(lost.state, TrackingState::kLost);
  EXPECT_FALSE(lost.relative.has_value());
  EXPECT_FALSE(lost.key_frame.has_value());
  const Tracker::Output found = tracker.step(world.render(5), nullptr, local, false);
  ASSERT_EQ(found.state, TrackingState::kTracking);
  EXPECT_LT((found.camera_from_world * PlaneWorld::world_from_camera(5)).translation().norm(), 0.002);
}

TEST_F(TrackerTest, LostForLongAPieceOfThePictureElsewhereIsNotWhereItWas) {
  const auto local = start();
  ASSERT_EQ(tracker.step(world.render(1), nullptr, local, false).state, TrackingState::kTracking);
  // A strange wall on which a piece of the known one hangs, moved aside.
  const RgbdFrame known = world.render(1);
  RgbdFrame strange = world.render(2);
  cv::rotate(strange.gray, strange.gray, cv::ROTATE_180);
  known.gray(cv::Rect(120, 90, 120, 88)).copyTo(strange.gray(cv::Rect(130, 90, 120, 88)));
  known.depth(cv::Rect(120, 90, 120, 88)).copyTo(strange.depth(cv::Rect(130, 90, 120, 88)));
  RgbdFrame dark = world.render(2);
  dark.gray.setTo(0);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(tracker.step(dark, nullptr, local, false).state, TrackingState::kLost);
  for (int i = 0; i < 6; ++i) ASSERT_EQ(tracker.step(dark, nullptr, local, false).state, TrackingState::kLost);
  EXPECT_EQ(tracker.step(strange, nullptr, local, false).state, TrackingState::kLost);
  EXPECT_EQ(tracker.step(world.render(3), nullptr, local, false).state, TrackingState::kTracking);
}

TEST_F(TrackerTest, DescriptorsAloneBridgeAJumpThatNoPredictionCovers) {
  const auto local = start();
  ASSERT_EQ(tracker.step(world.render(1), nullptr, local, false).state, TrackingState::kTracking);
  SE3::Tangent jump;
  jump << 0.25, 0.1, 0, 0, 0, 0.6;  // a third of the image and 34 degrees of roll
  const SE3 truth = SE3::exp(jump);
  const Tracker::Output out = tracker.step(world.render(truth, 2), nullptr, local, false);
  ASSERT_EQ(out.state, TrackingState::kTracking);
  EXPECT_LT((out.camera_from_world * truth).translation().norm(), 0.004);
}

TEST_F(TrackerTest, ThePreviousFrameBridgesWhatTheLocalMapDoesNotKnow) {
  const auto local = start();
  ASSERT_EQ(tracker.step(world.render(1), nullptr, local, false).state, TrackingState::kTracking);
  auto unknown = std::make_shared<LocalMap>(*local);
  unknown->points.clear();
  for (int i = 2; i <= 5; ++i) {
    const Tracker::Output out = tracker.step(world.render(i), nullptr, unknown, false);
    ASSERT_EQ(out.state, TrackingState::kTracking) << "frame " << i;
    EXPECT_LT((out.camera_from_world * PlaneWorld::world_from_camera(i)).translation().norm(), 0.006);
  }
  EXPECT_TRUE(tracker.step(world.render(6), nullptr, unknown, true).key_frame.has_value());
  RgbdFrame dark = world.render(7);
  dark.gray.setTo(0);
  ASSERT_EQ(tracker.step(dark, nullptr, unknown, false).state, TrackingState::kLost);
  EXPECT_EQ(tracker.step(world.render(8), nullptr, unknown, false).state, TrackingState::kLost)
      << "once lost, only the map tells where the camera is";
  EXPECT_EQ(tracker.step(world.render(9), nullptr, local, false).state, TrackingState::kTracking);
}

TEST_F(TrackerTest, ThePreviousFrameFollowsItsKeyFrameWhenMappingMovesThat) {
  const auto local = start();
  ASSERT_EQ(tracker.step(world.render(1), nullptr, local, false).state, TrackingState::kTracking);
  // Mapping moves the whole world by 0.5 m: everything relative stays as it was.
  const SE3 moved_from_old(Eigen::Quaterniond::Identity(), {0.5, 0, 0});
  auto moved = std::make_shared<LocalMap>(*local);
  for (auto& point : moved->points) point.position = moved_from_old * point.position;
  for (auto& key_frame : moved->key_frames)
    key_frame.camera_from_world = key_frame.camera_from_world * moved_from_old.inverse();
  const Tracker::Output out = tracker.step(world.render(2), nullptr, moved, false);
  ASSERT_EQ(out.state, TrackingState::kTracking);
  EXPECT_LT((out.camera_from_world * moved_from_old * PlaneWorld::world_from_camera(2)).translation().norm(), 0.002);
}

TEST_F(TrackerTest, InAMapThatIsThereTheFirstFramesAreLostAndLookedFor) {
  const auto local = start();
  Tracker later(TrackingOptions{}, OrbOptions{}, DynamicOptions{}, model, MapUse::kExtend);
  const Tracker::Output lost = later.step(world.render(1), nullptr, nullptr, true);
  EXPECT_EQ(lost.state, TrackingState::kLost);
  EXPECT_FALSE(lost.key_frame.has_value());
  ASSERT_TRUE(lost.search.has_value());
  const SE3 truth = PlaneWorld::world_from_camera(1).inverse();
  const SE3 reference = local->find(local->reference)->camera_from_world;
  const std::vector<LandmarkId> none(lost.search->features->size());
  ASSERT_TRUE(later.resume({lost.search->features, none, {local->reference, truth * reference.inverse()}, local}));
  const Tracker::Output found = later.step(world.render(2), nullptr, local, true);
  ASSERT_EQ(found.state, TrackingState::kTracking);
  EXPECT_LT((found.camera_from_world * PlaneWorld::world_from_camera(2)).translation().norm(), 0.002);
}

TEST_F(TrackerTest, ALostFrameBeginsAWorldOfItsOwnOnlyWhenItMay) {
  const auto local = start();
  ASSERT_EQ(tracker.step(world.render(1), nullptr, local, true).state, TrackingState::kTracking);
  const PlaneWorld elsewhere(8);
  EXPECT_EQ(tracker.step(elsewhere.render(2), nullptr, local, true).state, TrackingState::kLost);
  RgbdFrame blind = elsewhere.render(3);
  blind.depth.setTo(0);
  const Tracker::Output lost = tracker.step(blind, nullptr, local, true, true);
  EXPECT_EQ(lost.state, TrackingState::kLost) << "too little for a map";
  EXPECT_TRUE(lost.search.has_value());
  const Tracker::Output begun = tracker.step(elsewhere.render(4), nullptr, local, true, true);
  ASSERT_EQ(begun.state, TrackingState::kTracking);
  EXPECT_EQ(begun.camera_from_world.log().norm(), 0) << "the world is its camera";
  EXPECT_FALSE(begun.search.has_value()) << "it is not lost any more";
  EXPECT_FALSE(begun.relative.has_value());
  ASSERT_TRUE(begun.key_frame.has_value());
  EXPECT_FALSE(begun.key_frame->reference.valid());
  const std::vector<LandmarkId>& known = begun.key_frame->landmarks;
  EXPECT_TRUE(std::ranges::none_of(known, [](LandmarkId id) { return id.valid(); }));
  const auto other = begin_map(begun, SubMapId(1));
  EXPECT_EQ(other->sub_map, SubMapId(1));
  for (int i = 5; i <= 8; ++i) {
    const Tracker::Output out = tracker.step(elsewhere.render(i), nullptr, other, true);
    ASSERT_EQ(out.state, TrackingState::kTracking) << "frame " << i;
    const SE3 truth = PlaneWorld::world_from_camera(i).inverse() * PlaneWorld::world_from_camera(4);
    EXPECT_LT((out.camera_from_world * truth.inverse()).translation().norm(), 0.002) << "frame " << i;
  }
}

TEST_F(TrackerTest, ACameraThatIsOnlyLocalisedBeginsNothing) {
  Tracker follower(TrackingOptions{}, OrbOptions{}, DynamicOptions{}, model, MapUse::kFollow);
  EXPECT_EQ(follower.step(world.render(0), nullptr, nullptr, true, true).state, TrackingState::kLost);
}

TEST_F(TrackerTest, WhereOnlyTheCameraIsOfInterestTheSnapshotIsAskedForThatIsNearest) {
  auto local = std::make_shared<LocalMap>(*start());
  // Two more key frames on the way: near where the camera will be after 20 and after 40 frames.
  for (const int frame : {20, 40})
    local->key_frames.push_back(
        {KeyFrameId(static_cast<std::uint32_t>(frame)), PlaneWorld::world_from_camera(frame).inverse(), 0});
  Tracker later(TrackingOptions{}, OrbOptions{}, DynamicOptions{}, model, MapUse::kFollow);
  const Tracker::Output lost = later.step(world.render(0), nullptr, nullptr, true);
  ASSERT_TRUE(later.resume({lost.search->features,
                            std::vector<LandmarkId>(lost.search->features->size()),
                            {local->reference, SE3()},
                            local}));
  std::vector<std::pair<int, KeyFrameId>> asked;
  for (int i = 1; i <= 38; ++i) {
    const Tracker::Output out = later.step(world.render(i), nullptr, local, true);
    ASSERT_EQ(out.state, TrackingState::kTracking) << "frame " << i;
    EXPECT_FALSE(out.key_frame.has_value());
    if (out.local_map) asked.emplace_back(i, out.local_map->reference);
    if (i == 30) {  // it comes late
      local = std::make_shared<LocalMap>(*local);
      local->reference = KeyFrameId(20);
    }
  }
  ASSERT_EQ(asked.size(), 2u) << "not again while one is on its way";
  EXPECT_EQ(asked[0].second, KeyFrameId(20));
  EXPECT_NEAR(asked[0].first, 10, 4);
  EXPECT_EQ(asked[1], std::pair(31, KeyFrameId(40)));
}

TEST_F(TrackerTest, AKeyFrameIsAskedForWhenTheViewChangesAndOnlyWhenAllowed) {
  const auto local = start();
  bool asked = false;
  for (int i = 1; i <= 30 && !asked; ++i) {
    EXPECT_FALSE(i < 2 && asked);
    asked = tracker.step(world.render(i), nullptr, local, i >= 28).key_frame.has_value();
    if (i < 28) {
      EXPECT_FALSE(asked) << "not allowed before frame 28";
    }
  }
  EXPECT_TRUE(asked);
}

TEST_F(TrackerTest, NoFeatureIsTakenFromMaskedPixels) {
  const auto local = start();
  RgbdFrame frame = world.render(1);
  frame.mask = cv::Mat::zeros(frame.gray.size(), CV_8UC1);
  frame.mask(cv::Rect(0, 0, 160, 240)).setTo(255);
  TrackingOptions eager;
  eager.key_frame_ratio = 1;
  eager.max_frames_between = 1;
  Tracker masked(eager, OrbOptions{}, DynamicOptions{}, model);
  (void)masked.step(world.render(0), nullptr, nullptr, true);
  const Tracker::Output out = masked.step(frame, nullptr, local, true);
  ASSERT_TRUE(out.key_frame.has_value());
  for (const Keypoint& k : out.key_frame->features->orb.keypoints) EXPECT_GE(k.x_px, 159.f);
  EXPECT_EQ(out.dynamic->mask_source, MaskSource::kGiven);
  const MaskRuns& moving = out.key_frame->features->moving;
  EXPECT_TRUE(moving.contains({80, 120})) << "the key frame keeps its mask";
  EXPECT_FALSE(moving.contains({240, 120}));
}

TEST_F(TrackerTest, LandmarksThatTheDepthLooksThroughAreReported) {
  const auto local = start();
  TrackingOptions eager;
  eager.max_frames_between = 1;
  eager.min_frames_between = 0;
  Tracker looking(eager, OrbOptions{}, DynamicOptions{}, model);
  (void)looking.step(world.render(0), nullptr, nullptr, true);
  RgbdFrame frame = world.render(SE3(), 1);
  frame.depth(cv::Rect(0, 0, 160, 240)) *= 2;  // the left half of the wall has moved away
  const Tracker::Output out = looking.step(frame, nullptr, local, true);
  ASSERT_TRUE(out.key_frame.has_value());
  int through = 0;
  for (const LandmarkUse& use : out.key_frame->uses) {
    const LocalMap::Point* point = local->find(use.landmark);
    ASSERT_NE(point, nullptr);
    const double x_px = world.camera().project(point->position).x();
    if (x_px > 165) {
      EXPECT_EQ(use.seen_through, 0);
    }
    through += use.seen_through;
  }
  EXPECT_GT(through, 50);
}

}  // namespace
}  // namespace semvslam
