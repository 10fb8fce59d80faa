#include "semvslam/map/map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/vga_testing.h"

namespace semvslam {
namespace {

class MapTest : public testing::Test {
 protected:
  MapTest() : map(std::make_shared<ObservationModel>(vga(), NoiseModel{}, level_scales(OrbOptions{}))) {}

  KeyFrameId add_key_frame(double x_m, SubMapId sub_map = SubMapId(0)) {
    constexpr int kSeen = 6;
    auto f = std::make_shared<FrameFeatures>();
    for (int i = 0; i < kSeen; ++i) {
      f->orb.keypoints.push_back({100.f + 50.f * static_cast<float>(i), 240.f, 1.f, 0.f, 0});
      f->orb.descriptors.push_back({static_cast<std::uint64_t>(i), 0, 0, 0});
      f->x_px.push_back(f->orb.keypoints.back().x_px);
      f->y_px.push_back(240.f);
      f->depth_m.push_back(2.f);
    }
    return map.add_key_frame(FrameId(static_cast<std::uint32_t>(map.key_frames().size())), TimeStamp{},
                             SE3(Eigen::Quaterniond::Identity(), {-x_m, 0, 0}), f, sub_map);
  }
  void expect_consistent() const {
    const Status status = map.check_invariants();
    EXPECT_TRUE(status.ok()) << status.error().message;
  }

  Map map;
};

TEST_F(MapTest, ObservationsAreSeenFromBothSides) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0.1);
  const LandmarkId l = map.add_landmark({0, 0, 2}, a, 3);
  EXPECT_TRUE(map.add_observation(l, b, 2));
  EXPECT_EQ(map.key_frame(a)->landmarks[3], l);
  EXPECT_EQ(map.key_frame(b)->landmarks[2], l);
  EXPECT_THAT(map.landmark(l)->observations, testing::ElementsAre(Observation{a, 3}, Observation{b, 2}));
  expect_consistent();
}

TEST_F(MapTest, AKeyFrameSeesALandmarkOnceAndAFeatureHasOneLandmark) {
  const KeyFrameId a = add_key_frame(0);
  const LandmarkId l = map.add_landmark({0, 0, 2}, a, 0);
  const LandmarkId m = map.add_landmark({0, 0, 3}, a, 1);
  EXPECT_FALSE(map.add_observation(l, a, 2));
  EXPECT_FALSE(map.add_observation(m, a, 0));
  EXPECT_EQ(map.key_frame(a)->landmarks[0], l);
  expect_consistent();
}

TEST_F(MapTest, ALandmarkWithoutObservationsIsGone) {
  const KeyFrameId a = add_key_frame(0);
  const LandmarkId l = map.add_landmark({0, 0, 2}, a, 0);
  map.remove_observation(l, a);
  EXPECT_EQ(map.landmark(l), nullptr);
  EXPECT_FALSE(map.key_frame(a)->landmarks[0].valid());
  EXPECT_FALSE(map.resolve(l).valid());
  expect_consistent();
}

TEST_F(MapTest, FusionMovesObservationsAndLeavesAForwardingAddress) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0.1), c = add_key_frame(0.2);
  const LandmarkId into = map.add_landmark({0, 0, 2}, a, 0);
  const LandmarkId from = map.add_landmark({0, 0, 2}, b, 1);
  map.add_observation(from, c, 1);
  map.add_observation(into, c, 4);  // c knows both: the duplicate is dropped
  map.fuse_landmarks(from, into);
  EXPECT_EQ(map.resolve(from), into);
  EXPECT_THAT(map.landmark(into)->observations,
              testing::ElementsAre(Observation{a, 0}, Observation{b, 1}, Observation{c, 4}));
  EXPECT_FALSE(map.key_frame(c)->landmarks[1].valid());
  EXPECT_THAT(map.recent_fusions(), testing::ElementsAre(std::pair(from, into)));
  expect_consistent();
}

TEST_F(MapTest, ForwardingFollowsChainsAndEndsWithTheLandmark) {
  const KeyFrameId a = add_key_frame(0);
  const LandmarkId x = map.add_landmark({0, 0, 2}, a, 0), y = map.add_landmark({0, 0, 2}, a, 1),
                   z = map.add_landmark({0, 0, 2}, a, 2);
  map.fuse_landmarks(x, y);
  map.fuse_landmarks(y, z);
  EXPECT_EQ(map.resolve(x), z);
  map.remove_landmark(z);
  EXPECT_FALSE(map.resolve(x).valid());
  expect_consistent();
}

TEST_F(MapTest, ARemovedKeyFrameKeepsItsPoseRelativeToItsAnchor) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0.5), c = add_key_frame(1.0);
  const LandmarkId l = map.add_landmark({0, 0, 2}, b, 0);
  map.add_observation(l, a, 0);
  map.remove_key_frame(b, c);
  expect_consistent();
  EXPECT_EQ(map.landmark(l)->observations.size(), 1u);
  EXPECT_NEAR(map.camera_from_world(b)->translation().x(), -0.5, 1e-12);
  map.set_pose(c, SE3(Eigen::Quaterniond::Identity(), {-1.0, 0.25, 0}));
  EXPECT_NEAR(map.camera_from_world(b)->translation().y(), 0.25, 1e-12);
  map.remove_key_frame(c, a);  // anchors form chains
  EXPECT_NEAR(map.camera_from_world(b)->translation().y(), 0.25, 1e-12);
  EXPECT_FALSE(map.camera_from_world(KeyFrameId(99)).has_value());
  EXPECT_THROW(map.remove_key_frame(c, a), std::logic_error);
}

TEST_F(MapTest, JoiningMovesASubMapWithAllThatIsInItOrWas) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0, SubMapId(1)), gone = add_key_frame(0.5, SubMapId(1));
  const LandmarkId of_a = map.add_landmark({0, 0, 2}, a, 0), of_b = map.add_landmark({0, 0, 2}, b, 0);
  map.remove_key_frame(gone, b);
  expect_consistent();
  EXPECT_THAT(map.sub_maps(), testing::ElementsAre(std::pair(SubMapId(0), a), std::pair(SubMapId(1), b)));
  EXPECT_EQ(map.sub_map_of(gone), SubMapId(1));
  EXPECT_FALSE(map.sub_map_of(KeyFrameId(99)).valid());

  const SE3 into_from_from(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {0, 3, 0});
  map.join(SubMapId(1), SubMapId(0), into_from_from);
  expect_consistent();
  EXPECT_THAT(map.sub_maps(), testing::ElementsAre(std::pair(SubMapId(0), a)));
  EXPECT_EQ(map.next_sub_map(), SubMapId(2));
  EXPECT_EQ(map.sub_map_of(gone), SubMapId(0));
  EXPECT_LT((map.camera_from_world(b)->inverse().translation() - Eigen::Vector3d(0, 3, 0)).norm(), 1e-12);
  EXPECT_LT((map.camera_from_world(gone)->inverse().translation() - Eigen::Vector3d(0, 3.5, 0)).norm(), 1e-12);
  EXPECT_LT((map.landmark(of_b)->position - Eigen::Vector3d(0, 3, 2)).norm(), 1e-12);
  EXPECT_EQ(map.landmark(of_a)->position, Eigen::Vector3d(0, 0, 2));
  EXPECT_THROW(map.join(SubMapId(1), SubMapId(0), SE3()), std::logic_error);
}

TEST_F(MapTest, APartHoldsOneSubMapAlone) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0, SubMapId(1)), c = add_key_frame(0.1);
  const LandmarkId of_a = map.add_landmark({0, 0, 2}, a, 0), of_b = map.add_landmark({0, 0, 3}, b, 0);
  map.add_observation(of_a, c, 1);
  EXPECT_THAT(map.key_frames_of(SubMapId(0)), testing::ElementsAre(a, c));
  EXPECT_THAT(map.landmark_ids(SubMapId(1)), testing::ElementsAre(of_b));
  const Map part = map.part(SubMapId(1));
  EXPECT_TRUE(part.check_invariants().ok());
  EXPECT_EQ(part.key_frames().size(), 1u);
  EXPECT_EQ(part.landmark_positions(), map.landmark_positions(SubMapId(1)));
  EXPECT_EQ(part.next_key_frame(), map.next_key_frame());
  EXPECT_TRUE(map.part(SubMapId(7)).key_frames().empty());
}

TEST_F(MapTest, ALandmarkOfTwoSubMapsIsAContradiction) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0, SubMapId(1));
  map.add_observation(map.add_landmark({0, 0, 2}, a, 0), b, 0);
  EXPECT_THAT(map.check_invariants().error().message, testing::HasSubstr("two sub-maps"));
}

TEST_F(MapTest, CovisibleKeyFramesAreRankedBySharedLandmarks) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0.1), c = add_key_frame(0.2), lonely = add_key_frame(9);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const LandmarkId l = map.add_landmark({0, 0, 2.0 + i}, a, i);
    map.add_observation(l, c, i);
    if (i < 2) map.add_observation(l, b, i);
  }
  const std::vector<Covisible> ranked = map.covisible(a, 1);
  ASSERT_EQ(ranked.size(), 2u);
  EXPECT_EQ(ranked[0].key_frame, c);
  EXPECT_EQ(ranked[0].shared, 4);
  EXPECT_EQ(ranked[1].key_frame, b);
  EXPECT_EQ(map.covisible(a, 3).size(), 1u);
  EXPECT_TRUE(map.covisible(lonely, 1).empty());
}

TEST_F(MapTest, LandmarksOfKeyFramesComeOnceAndInOrder) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0.1), c = add_key_frame(0.2);
  const LandmarkId first = map.add_landmark({0, 0, 2}, a, 5);
  const LandmarkId second = map.add_landmark({0, 0, 2}, b, 0);
  map.add_landmark({0, 0, 2}, c, 1);
  map.add_observation(first, b, 3);
  EXPECT_THAT(map.landmarks_of({b, a}), testing::ElementsAre(first, second));
  EXPECT_TRUE(map.landmarks_of({}).empty());
}

TEST_F(MapTest, GeometryOfALandmarkFollowsFromItsObservations) {
  const KeyFrameId a = add_key_frame(-1), b = add_key_frame(1);
  const LandmarkId l = map.add_landmark({0, 0, 2}, a, 0);
  map.add_observation(l, b, 0);
  map.refresh_landmark(l);
  const Landmark& landmark = *map.landmark(l);
  EXPECT_NEAR(landmark.normal.z(), 1.f, 1e-6f);  // mean of two rays that mirror each other
  EXPECT_NEAR(landmark.max_distance_m, std::sqrt(5.0), 1e-5);
  EXPECT_NEAR(landmark.min_distance_m, std::sqrt(5.0) / std::pow(1.2, 7), 1e-5);
}

TEST_F(MapTest, TheDescriptorIsTheOneNearestToAllOthers) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0.1), c = add_key_frame(0.2);
  const LandmarkId l = map.add_landmark({0, 0, 2}, a, 0);  // 0b00
  map.add_observation(l, b, 1);                            // 0b01
  map.add_observation(l, c, 3);                            // 0b11
  map.refresh_landmark(l);
  EXPECT_EQ(map.landmark(l)->descriptor[0], 1u);
}

TEST(ObservationModel, WeightsFollowLevelAndDepth) {
  NoiseModel noise;
  noise.pixel_sigma_px = 0.5;
  noise.disparity_sigma_px = 0.25;
  const ObservationModel model(vga(), noise, level_scales(OrbOptions{}));
  FrameFeatures f;
  f.orb.keypoints = {{10, 20, 1, 0, 0}, {30, 40, 1, 0, 2}};
  f.orb.descriptors.resize(2);
  cv::Mat depth(480, 640, CV_16UC1, cv::Scalar(0));
  depth(cv::Rect(5, 15, 10, 10)).setTo(10000);  // 2 m
  measure(model, depth, f);
  EXPECT_FLOAT_EQ(f.depth_m[0], 2.f);
  EXPECT_FALSE(f.has_depth(1));
  EXPECT_DOUBLE_EQ(model.observation(f, 0).inverse_variance_px, 4.0);
  EXPECT_NEAR(model.observation(f, 1).inverse_variance_px, 4.0 / std::pow(1.2, 4), 1e-6);
  EXPECT_NEAR(model.observation(f, 0).disparity_px, 500 * 0.075 / 2, 1e-6);
  EXPECT_LE(model.observation(f, 1).disparity_px, 0);
}

TEST(ObservationModel, DepthAtEdgesAndOutsideTheRangeIsNotUsed) {
  const ObservationModel model(vga(), NoiseModel{}, level_scales(OrbOptions{}));
  FrameFeatures f;
  f.orb.keypoints = {{100, 100, 1, 0, 0}, {200, 100, 1, 0, 0}, {300, 100, 1, 0, 0}, {0, 0, 1, 0, 0}};
  f.orb.descriptors.resize(4);
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(2.f));
  depth.at<float>(101, 101) = 3.f;               // an edge beside the first
  depth(cv::Rect(190, 90, 20, 20)).setTo(50.f);  // beyond the range
  depth(cv::Rect(290, 90, 20, 20)).setTo(std::numeric_limits<float>::quiet_NaN());
  measure(model, depth, f);
  EXPECT_FALSE(f.has_depth(0));
  EXPECT_FALSE(f.has_depth(1));
  EXPECT_FALSE(f.has_depth(2));
  EXPECT_FLOAT_EQ(f.depth_m[3], 2.f);  // at the border the window is smaller
}

TEST_F(MapTest, IsRestoredFromItsContentAndRefusesWhatContradictsItself) {
  const KeyFrameId a = add_key_frame(0), b = add_key_frame(0.1);
  const LandmarkId l = map.add_landmark({0, 0, 2}, a, 3);
  map.add_observation(l, b, 1);
  const auto model = std::make_shared<ObservationModel>(map.model());
  const MapContent whole{{*map.key_frame(a), *map.key_frame(b)}, {*map.landmark(l)}, KeyFrameId(7), LandmarkId(5)};
  const auto fault = [&](const auto& change) {
    MapContent content = whole;
    change(content);
    const Result<Map> restored = Map::restore(model, std::move(content));
    return restored ? "" : restored.error().message;
  };
  Result<Map> restored = Map::restore(model, whole);
  ASSERT_TRUE(restored.ok());
  EXPECT_EQ(restored->key_frame(b)->landmarks, map.key_frame(b)->landmarks);
  EXPECT_EQ(restored->landmark(l)->descriptor, map.landmark(l)->descriptor);
  EXPECT_EQ(restored->first_of_session(), KeyFrameId(7));
  EXPECT_EQ(restored->next_landmark(), LandmarkId(5));
  using testing::HasSubstr;
  EXPECT_THAT(fault([](MapContent& c) { c.next_key_frame = KeyFrameId(1); }), HasSubstr("key frame 1 has an id"));
  EXPECT_THAT(fault([](MapContent& c) { c.key_frames[1].id = KeyFrameId(0); }),
              HasSubstr("key frame 0 is there twice"));
  EXPECT_THAT(fault([](MapContent& c) { c.landmarks.push_back(c.landmarks[0]); }),
              HasSubstr("landmark 0 is there twice"));
  EXPECT_THAT(fault([](MapContent& c) { c.landmarks[0].observations[1].feature = 6; }), HasSubstr("is not there"));
  EXPECT_THAT(fault([](MapContent& c) { c.landmarks[0].observations[1].key_frame = KeyFrameId(0); }),
              HasSubstr("twice"));
  EXPECT_THAT(fault([](MapContent& c) { c.landmarks[0].observations.clear(); }), HasSubstr("seen by nobody"));
}

}  // namespace
}  // namespace semvslam
