#include "semvslam/mapping/revisit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/vga_testing.h"

namespace semvslam {
namespace {

/// A camera that turns once around in a round room, and a little farther. Its map drifts: each key frame knows the
/// landmarks that the one before it saw, with poses that are off by a little more every time.
class RevisitTest : public testing::Test {
 protected:
  static constexpr int kTurn = 60;  // key frames once around

  RevisitTest()
      : model(std::make_shared<ObservationModel>(vga(), NoiseModel{}, level_scales(OrbOptions{}))), map(model) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi), y(-1.2, 1.2), radius(2.5, 3.5);
    for (int i = 0; i < 1500; ++i) {
      const double a = angle(random), r = radius(random);
      points.push_back({r * std::sin(a), y(random), r * std::cos(a)});
      descriptors.push_back({random(), random(), random(), random()});
    }
    known.resize(points.size());
  }

  static SE3 truth(int i) {
    const Eigen::AngleAxisd turn(-2 * std::numbers::pi * i / kTurn, Eigen::Vector3d::UnitY());
    return {Eigen::Quaterniond(turn), Eigen::Vector3d::Zero()};
  }
  /// Along and around the axis of the turn: then every step drifts alike, which is what spreading it evenly undoes.
  static SE3 drift(int i, double total_rad) {
    SE3::Tangent xi;
    xi << 0, total_rad, 0, 0, total_rad, 0;
    return SE3::exp(xi * i / kTurn);
  }

  KeyFrameId add(int i, double drift_rad) {
    auto f = std::make_shared<FrameFeatures>();
    std::vector<std::size_t> point_of;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3d p = truth(i) * points[k];
      if (p.z() < 0.5) continue;
      const Eigen::Vector2d pixel = model->camera().project(p);
      if (!model->camera().sees(pixel)) continue;
      f->orb.keypoints.push_back({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 1, 0, 3});
      f->orb.descriptors.push_back(descriptors[k]);
      f->x_px.push_back(static_cast<float>(pixel.x()));
      f->y_px.push_back(static_cast<float>(pixel.y()));
      f->depth_m.push_back(static_cast<float>(p.z()));
      point_of.push_back(k);
    }
    f->grid.build(f->x_px, f->y_px, 640, 480);
    const SE3 pose = drift(i, drift_rad) * truth(i);
    const KeyFrameId id = map.add_key_frame(FrameId(static_cast<std::uint32_t>(i)), TimeStamp{i}, pose, f);
    std::vector<LandmarkId> seen(points.size());
    for (std::uint32_t n = 0; n < point_of.size(); ++n) {
      const std::size_t k = point_of[n];
      if (known[k].valid())
        map.add_observation(known[k], id, n);
      else
        known[k] = map.add_landmark(pose.inverse() * model->back_project(*f, n), id, n);
      seen[k] = known[k];
    }
    known = seen;  // what leaves the image is forgotten
    return id;
  }

  double worst_error_m() const {
    double worst = 0;
    for (const auto& [id, key_frame] : map.key_frames())
      worst = std::max(
          worst, (key_frame.camera_from_world * truth(static_cast<int>(key_frame.frame.value)).inverse()).log().norm());
    return worst;
  }

  std::shared_ptr<const ObservationModel> model;
  Map map;
  std::vector<Eigen::Vector3d> points;
  std::vector<Descriptor> descriptors;
  std::vector<LandmarkId> known;  // per point, as the newest key frame has it
};

constexpr double kDriftRad = 0.015;  // 7.5 px at the end of the turn

TEST_F(RevisitTest, APlaceSeenAgainAfterDriftIsFound) {
  KeyFrameId newest;
  for (int i = 0; i <= kTurn; ++i) newest = add(i, kDriftRad);
  const auto revisit = find_revisit(map, newest, {});
  ASSERT_TRUE(revisit.has_value());
  EXPECT_GT(revisit->shift_px, 5);
  EXPECT_GT(revisit->matches.size(), 100u);
  EXPECT_LT((revisit->camera_from_world * truth(kTurn).inverse()).log().norm(), 1e-3)
      << "the first key frames have no drift";
}

TEST_F(RevisitTest, ClosingSpreadsTheDriftAndFusesTheLandmarks) {
  KeyFrameId newest;
  for (int i = 0; i <= kTurn; ++i) newest = add(i, kDriftRad);
  const double before = worst_error_m();
  const std::size_t landmarks = map.landmark_count();
  const auto revisit = find_revisit(map, newest, {});
  ASSERT_TRUE(revisit.has_value());
  ASSERT_TRUE(close_revisit(map, newest, *revisit));
  const Status status = map.check_invariants();
  EXPECT_TRUE(status.ok()) << status.error().message;
  EXPECT_GT(before, 0.015);
  // Key frames at both ends have fewer neighbours that hold them, so the drift is not spread quite evenly.
  EXPECT_LT(worst_error_m(), 0.4 * before);
  EXPECT_LT((map.key_frame(newest)->camera_from_world * truth(kTurn).inverse()).log().norm(), 0.2 * before);
  EXPECT_EQ(map.landmark_count(), landmarks - revisit->matches.size());
  for (const LandmarkId l : map.landmark_ids()) {
    const Landmark& landmark = *map.landmark(l);
    double nearest = 1;
    for (const Eigen::Vector3d& p : points) nearest = std::min(nearest, (p - landmark.position).norm());
    ASSERT_LT(nearest, 0.02) << "landmark " << l.value << " did not move with its key frame";
  }
  EXPECT_FALSE(find_revisit(map, newest, {}).has_value()) << "nothing is left to correct";
}

TEST_F(RevisitTest, WithoutDriftThereIsNothingToDo) {
  KeyFrameId newest;
  for (int i = 0; i <= kTurn; ++i) newest = add(i, 0);
  EXPECT_FALSE(find_revisit(map, newest, {.min_inliers = 20}).has_value());
}

TEST_F(RevisitTest, WhatIsStillFollowedIsNoRevisit) {
  KeyFrameId newest;
  for (int i = 0; i < 20; ++i) newest = add(0, i * 0.001);
  EXPECT_FALSE(find_revisit(map, newest, {}).has_value());
}

TEST_F(RevisitTest, APlaceThatOnlyLiesWhereTheOtherWasIsNone) {
  for (int i = 0; i < kTurn; ++i) (void)add(i, kDriftRad);
  std::mt19937 random(6);
  for (Descriptor& d : descriptors) d = {random(), random(), random(), random()};
  EXPECT_FALSE(find_revisit(map, add(kTurn, kDriftRad), {}).has_value());
}

TEST_F(RevisitTest, TheFirstKeyFrameHasNothingEarlier) { EXPECT_FALSE(find_revisit(map, add(0, 0), {}).has_value()); }

}  // namespace
}  // namespace semvslam
