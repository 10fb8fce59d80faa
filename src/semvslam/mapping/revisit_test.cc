#include "semvslam/mapping/revisit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "semvslam/mapping/round_room_test_support.h"

namespace semvslam {
namespace {

class RevisitTest : public testing::Test, protected testing_support::DriftingMap {};

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
    for (const Eigen::Vector3d& p : room.corners) nearest = std::min(nearest, (p - landmark.position).norm());
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
  for (Descriptor& d : room.descriptors) d = {random(), random(), random(), random()};
  EXPECT_FALSE(find_revisit(map, add(kTurn, kDriftRad), {}).has_value());
}

TEST_F(RevisitTest, TheFirstKeyFrameHasNothingEarlier) { EXPECT_FALSE(find_revisit(map, add(0, 0), {}).has_value()); }

}  // namespace
}  // namespace semvslam
