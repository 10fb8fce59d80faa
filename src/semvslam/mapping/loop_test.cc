#include "semvslam/mapping/loop.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "semvslam/mapping/round_room_test_support.h"

namespace semvslam {
namespace {

constexpr double kLoopDriftRad = 0.25;  // 125 px after a turn: far beyond any window around where the camera should be

class LoopTest : public testing::Test, protected testing_support::DriftingMap {
 protected:
  /// Key frame i enters; what the finder makes of it.
  std::optional<Revisit> enter(int i, double drift_rad) {
    newest = add(i, drift_rad);
    for (const LandmarkId l : map.key_frame(newest)->landmarks) map.refresh_landmark(l);
    places.add(newest, map.key_frame(newest)->features->orb.descriptors);
    return finder.find(map, places, newest);
  }
  /// Once around and a little farther, until a loop is found. @return the key frame that found it, or -1.
  int go_around(double drift_rad, int most = kTurn + 3) {
    for (int i = 0; i <= most; ++i) {
      loop = enter(i, drift_rad);
      if (loop) return i;
    }
    return -1;
  }

  LoopFinder finder{{}};
  PlaceIndex places;
  KeyFrameId newest;
  std::optional<Revisit> loop;
};

TEST_F(LoopTest, APlaceIsRecognisedHoweverFarTheMapHasDrifted) {
  const int at = go_around(kLoopDriftRad);
  ASSERT_GE(at, kTurn - 8) << "the first images' edge comes into view";
  EXPECT_GE(loop->matches.size(), 40u);
  EXPECT_GT(loop->shift_px, 50);
  EXPECT_FALSE(find_revisit(map, newest, {})) << "too far for a search around the pose";
  // The earlier visit has drifted by little, so its landmarks tell the true pose.
  EXPECT_LT((loop->camera_from_world * truth(at).inverse()).log().norm(), 0.15 * kLoopDriftRad);
}

TEST_F(LoopTest, ClosingItTakesTheDriftAway) {
  ASSERT_GE(go_around(kLoopDriftRad), 0);
  const double before = worst_error_m();
  ASSERT_TRUE(close_revisit(map, newest, *loop));
  const Status status = map.check_invariants();
  EXPECT_TRUE(status.ok()) << status.error().message;
  EXPECT_LT(worst_error_m(), 0.4 * before);
}

TEST_F(LoopTest, OneKeyFrameAloneDecidesNothing) {
  const int at = go_around(kLoopDriftRad);
  ASSERT_GE(at, 0);
  finder = LoopFinder({});
  EXPECT_FALSE(finder.find(map, places, newest)) << "the first of a finder has none before it";
  EXPECT_TRUE(finder.find(map, places, newest));
}

TEST_F(LoopTest, TwoThatDisagreeDecideNothing) {
  int first = -1;
  for (int i = 0; i <= kTurn && first < 0; ++i)
    if (enter(i, kLoopDriftRad)) first = i;
  ASSERT_GE(first, 0);
  finder = LoopFinder({});
  EXPECT_FALSE(finder.find(map, places, newest));
  // The map's idea of the newest pose jumps in between: then what was found before meant another correction.
  SE3::Tangent jump;
  jump << 0.6, 0, 0, 0, 0, 0;
  map.set_pose(newest, SE3::exp(jump) * map.key_frame(newest)->camera_from_world);
  EXPECT_FALSE(finder.find(map, places, newest));
}

TEST_F(LoopTest, WithoutDriftThereIsNothingToDo) { EXPECT_EQ(go_around(0), -1); }

TEST_F(LoopTest, ACorrectionTooLargeForTheWayIsALookAlike) {
  finder = LoopFinder({.max_drift_share = 0, .drift_allowance_m = 0.1, .drift_allowance_deg = 180});
  EXPECT_EQ(go_around(kLoopDriftRad), -1);
}

TEST_F(LoopTest, AMovedThingIsNoPlace) {
  for (int i = 0; i < kTurn - 12; ++i) (void)enter(i, kLoopDriftRad);
  // What the first key frames saw is painted over, but for a picture on the wall.
  for (std::size_t k = 0; k < room.corners.size(); ++k) {
    const Eigen::Vector3d& p = room.corners[k];
    if (p.z() > 0 && (std::abs(p.x()) > 0.55 || std::abs(p.y()) > 0.4))
      room.descriptors[k] = {room.noise(), room.noise(), room.noise(), room.noise()};
  }
  LoopFinder gullible({.min_inliers = 20, .min_seen_share = 0});
  finder = LoopFinder({.min_inliers = 20});
  bool taken_in = false;
  for (int i = kTurn - 12; i <= kTurn + 3; ++i) {
    EXPECT_FALSE(enter(i, kLoopDriftRad)) << i;
    taken_in |= gullible.find(map, places, newest).has_value();
  }
  EXPECT_TRUE(taken_in) << "or the picture proves nothing";
}

TEST_F(LoopTest, WhatIsStillFollowedIsNoLoop) {
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(enter(0, i * 0.001));
}

}  // namespace
}  // namespace semvslam
