#include "semvslam/mapping/mapper.h"

#include <gtest/gtest.h>

#include <random>

#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/vga_testing.h"

namespace semvslam {
namespace {

/// Points before a camera that moves sideways; features are their exact projections.
class MapperTest : public testing::Test {
 protected:
  MapperTest()
      : model(std::make_shared<ObservationModel>(vga(), NoiseModel{}, level_scales(OrbOptions{}))),
        mapper(MappingOptions{}, model) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> x(-2, 2), y(-0.8, 0.8), z(1.5, 3);
    for (int i = 0; i < 400; ++i) {
      points.push_back({x(random), y(random), z(random)});
      descriptors.push_back({random(), random(), random(), random()});
    }
  }

  static SE3 truth(int frame) { return {Eigen::Quaterniond::Identity(), {-0.05 * frame, 0.01 * frame, 0}}; }

  /// @param known ids by point, invalid = not known yet. @param noise_px of the pixels.
  NewKeyFrame view(int frame, const SE3& guess, const std::vector<LandmarkId>& known, double noise_px = 0) {
    auto f = std::make_shared<FrameFeatures>();
    NewKeyFrame k{FrameId(static_cast<std::uint32_t>(frame)), TimeStamp{frame}, guess, nullptr, {}};
    std::normal_distribution<double> noise(0, noise_px > 0 ? noise_px : 1);
    point_of_feature.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = truth(frame) * points[i];
      Eigen::Vector2d pixel = model->camera().project(p);
      if (noise_px > 0) pixel += Eigen::Vector2d(noise(random_), noise(random_));
      if (pixel.x() < 1 || pixel.y() < 1 || pixel.x() > 638 || pixel.y() > 478) continue;
      f->orb.keypoints.push_back({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 1, 0, 3});
      f->orb.descriptors.push_back(descriptors[i]);
      f->x_px.push_back(static_cast<float>(pixel.x()));
      f->y_px.push_back(static_cast<float>(pixel.y()));
      f->depth_m.push_back(static_cast<float>(p.z()));
      k.landmarks.push_back(known.empty() ? LandmarkId() : known[i]);
      point_of_feature.push_back(i);
    }
    f->grid.build(f->x_px, f->y_px, 640, 480);
    k.features = f;
    return k;
  }

  std::vector<LandmarkId> landmarks_by_point() const {
    std::vector<LandmarkId> ids(points.size());
    const KeyFrame& newest = mapper.map().key_frames().rbegin()->second;
    for (std::size_t i = 0; i < point_of_feature.size(); ++i) ids[point_of_feature[i]] = newest.landmarks[i];
    return ids;
  }
  void expect_consistent() const {
    const Status status = mapper.map().check_invariants();
    EXPECT_TRUE(status.ok()) << status.error().message;
  }

  std::shared_ptr<const ObservationModel> model;
  Mapper mapper;
  std::vector<Eigen::Vector3d> points;
  std::vector<Descriptor> descriptors;
  std::vector<std::size_t> point_of_feature;
  std::mt19937 random_{11};
};

TEST_F(MapperTest, DepthMakesLandmarksAtOnceAndTheSnapshotHoldsThem) {
  const auto local = mapper.step(view(0, truth(0), {}));
  expect_consistent();
  EXPECT_EQ(mapper.map().landmark_count(), point_of_feature.size());
  EXPECT_EQ(local->points.size(), point_of_feature.size());
  EXPECT_EQ(local->reference_matches, static_cast<int>(point_of_feature.size()));
  const std::vector<LandmarkId> ids = landmarks_by_point();
  for (const std::size_t i : point_of_feature) {
    ASSERT_NE(local->find(ids[i]), nullptr);
    EXPECT_LT((local->find(ids[i])->position - points[i]).norm(), 1e-5);
  }
}

TEST_F(MapperTest, WhatTrackingMissedIsFoundAndNotMadeTwice) {
  (void)mapper.step(view(0, truth(0), {}));
  const std::size_t before = mapper.map().landmark_count();
  (void)mapper.step(view(1, truth(1), {}));  // tracking matched nothing: every feature makes a duplicate first
  expect_consistent();
  std::size_t fresh = 0;
  for (const LandmarkId id : mapper.map().landmark_ids()) fresh += mapper.map().landmark(id)->observations.size() == 1;
  EXPECT_LT(mapper.map().landmark_count(), before + before / 5);
  EXPECT_LT(fresh, before / 5);
  EXPECT_FALSE(mapper.map().recent_fusions().empty());
}

TEST_F(MapperTest, BundleAdjustmentPullsAWrongPoseBack) {
  (void)mapper.step(view(0, truth(0), {}));
  for (int i = 1; i < 5; ++i) {
    SE3::Tangent off;
    off << 0.01, -0.01, 0.01, 0.003, -0.002, 0.002;
    (void)mapper.step(view(i, SE3::exp(off) * truth(i), landmarks_by_point(), 0.1));
    expect_consistent();
  }
  for (const auto& [id, key_frame] : mapper.map().key_frames()) {
    const SE3 error = key_frame.camera_from_world * truth(static_cast<int>(key_frame.frame.value)).inverse();
    EXPECT_LT(error.translation().norm(), 0.003) << "key frame " << id.value;
    EXPECT_LT(error.rotation_angle_rad(), 0.001) << "key frame " << id.value;
  }
}

TEST_F(MapperTest, YoungLandmarksThatAreSeldomFoundGo) {
  (void)mapper.step(view(0, truth(0), {}));
  const std::vector<LandmarkId> ids = landmarks_by_point();
  const LandmarkId victim = ids[point_of_feature.front()];
  mapper.count_use(victim, 20, 1, 0);
  (void)mapper.step(view(1, truth(1), ids));
  EXPECT_EQ(mapper.map().landmark(victim), nullptr);
  expect_consistent();
}

TEST_F(MapperTest, LandmarksWhoseCarrierHasGoneGo) {
  (void)mapper.step(view(0, truth(0), {}));
  const std::vector<LandmarkId> ids = landmarks_by_point();
  const LandmarkId gone = ids[point_of_feature[0]], still_found = ids[point_of_feature[1]];
  mapper.count_use(gone, 0, 0, 5);
  mapper.count_use(still_found, 0, 9, 5);
  EXPECT_EQ(mapper.map().landmark(gone), nullptr);
  EXPECT_NE(mapper.map().landmark(still_found), nullptr);
  expect_consistent();
}

TEST_F(MapperTest, KeyFramesThatAddNothingGoAndTheirPoseStaysKnown) {
  (void)mapper.step(view(0, truth(0), {}));
  for (int i = 1; i < 12; ++i) (void)mapper.step(view(i % 2, truth(i % 2), landmarks_by_point()));
  expect_consistent();
  EXPECT_LT(mapper.map().key_frames().size(), 8u);
  for (std::uint32_t i = 0; i < 12; ++i) {
    const std::optional<SE3> pose = mapper.map().camera_from_world(KeyFrameId(i));
    ASSERT_TRUE(pose.has_value());
    EXPECT_LT((*pose * truth(static_cast<int>(i % 2)).inverse()).translation().norm(), 0.003);
  }
}

TEST_F(MapperTest, GoesOnWithAMapOfAnEarlierSession) {
  for (int i = 0; i < 3; ++i)
    (void)mapper.step(view(i, truth(i), i == 0 ? std::vector<LandmarkId>{} : landmarks_by_point()));
  const NewKeyFrame next = view(3, truth(3), landmarks_by_point());
  Mapper later(MappingOptions{}, mapper.map());
  const std::optional<Relocalisation> found = later.relocalise(*next.features);
  ASSERT_TRUE(found) << "the index of places is there";
  EXPECT_LT((found->camera_from_world * truth(3).inverse()).log().norm(), 0.01);
  const std::size_t landmarks = later.map().landmark_count();
  (void)later.step(next);
  EXPECT_TRUE(later.map().check_invariants().ok());
  EXPECT_EQ(later.map().key_frames().rbegin()->first, mapper.map().next_key_frame());
  EXPECT_LT(later.map().landmark_count(), landmarks + landmarks / 5) << "what it sees is what is there";
}

TEST_F(MapperTest, TheSameCallsGiveTheSameMap) {
  Mapper other(MappingOptions{}, model);
  for (int i = 0; i < 4; ++i) {
    const NewKeyFrame key_frame = view(i, truth(i), {}, 0.3);
    (void)mapper.step(key_frame);
    (void)other.step(key_frame);
  }
  ASSERT_EQ(mapper.map().landmark_ids(), other.map().landmark_ids());
  for (const LandmarkId id : mapper.map().landmark_ids())
    EXPECT_EQ(mapper.map().landmark(id)->position, other.map().landmark(id)->position);
}

}  // namespace
}  // namespace semvslam
