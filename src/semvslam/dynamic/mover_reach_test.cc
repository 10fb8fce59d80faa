#include "semvslam/dynamic/mover_reach.h"

#include <gtest/gtest.h>

#include <cmath>

namespace semvslam {
namespace {

constexpr int kReachWidth = 320, kReachHeight = 240;
constexpr float kWallM = 4, kPersonM = 2;
constexpr double kReachM = 0.6;
const cv::Rect kTorso(120, 40, 60, 80), kLeg(130, 120, 24, 100);  // the mask ends where the leg begins

Camera reach_camera() {
  Camera camera;
  camera.width_px = kReachWidth;
  camera.height_px = kReachHeight;
  camera.fx_px = camera.fy_px = 250;  // a pixel is 8 mm wide at the person
  camera.cx_px = 159.5;
  camera.cy_px = 119.5;
  return camera;
}

cv::Mat person_before_wall() {
  cv::Mat depth(kReachHeight, kReachWidth, CV_32FC1, cv::Scalar(kWallM));
  depth(kTorso).setTo(kPersonM);
  depth(kLeg).setTo(kPersonM);
  return depth;
}

MoverReach reach_of_torso(const cv::Mat& depth) {
  MoverReach reach(reach_camera(), depth, kReachM);
  reach.add(kTorso, cv::Mat(kTorso.size(), CV_8UC1, cv::Scalar(255)), kPersonM);
  reach.spread();
  return reach;
}

TEST(MoverReach, GoesAlongTheSurfaceAndNotOntoTheWall) {
  const MoverReach reach = reach_of_torso(person_before_wall());
  EXPECT_EQ(reach.distance_m({150, 80}), 0);
  EXPECT_NEAR(reach.distance_m({140, 145}), 25 * kPersonM / 250, 0.04);
  EXPECT_NEAR(reach.distance_m({140, 180}), 60 * kPersonM / 250, 0.04);
  EXPECT_TRUE(std::isinf(reach.distance_m({140, 210}))) << "beyond the reach";
  EXPECT_TRUE(std::isinf(reach.distance_m({200, 80}))) << "the wall beside her";
}

TEST(MoverReach, GoesOnBehindASmallHole) {
  cv::Mat depth = person_before_wall();
  depth.rowRange(124, 134).setTo(0);
  EXPECT_NEAR(reach_of_torso(depth).distance_m({140, 160}), 40 * kPersonM / 250, 0.04);
  depth.rowRange(124, 148).setTo(0);
  EXPECT_TRUE(std::isinf(reach_of_torso(depth).distance_m({140, 160})));
}

TEST(MoverReach, DoesNotFollowASurfaceAwayFromTheBody) {
  // A table that begins at her waist and comes towards the camera: a metre over forty rows.
  cv::Mat depth = person_before_wall();
  for (int y = 120; y < kReachHeight; ++y) depth.row(y).setTo(kPersonM - 0.01f * static_cast<float>(y - 119));
  const MoverReach reach = reach_of_torso(depth);
  EXPECT_LT(reach.distance_m({150, 135}), kReachM);
  EXPECT_TRUE(std::isinf(reach.distance_m({150, 160})));
}

TEST(MoverReach, TheRimOfAMaskMayLieOnWhatIsBehind) {
  cv::Mat depth = person_before_wall();
  MoverReach reach(reach_camera(), depth, kReachM);
  const cv::Rect too_wide(kTorso.x - 4, kTorso.y, kTorso.width + 8, kTorso.height);
  reach.add(too_wide, cv::Mat(too_wide.size(), CV_8UC1, cv::Scalar(255)), kPersonM);
  reach.spread();
  EXPECT_TRUE(std::isinf(reach.distance_m({200, 80})));
  EXPECT_LT(reach.distance_m({140, 145}), kReachM);
}

TEST(MoverReach, KnowsWhereItsDepthMeetsAnother) {
  cv::Mat depth = person_before_wall();
  depth(cv::Rect(200, 60, 8, 8)).setTo(kPersonM);    // seen through a gap in the wall
  depth(cv::Rect(224, 60, 8, 8)).setTo(kWallM - 1);  // something else before the wall
  depth(cv::Rect(300, 60, 8, 8)).setTo(kPersonM);    // too far away in the picture
  const MoverReach reach = reach_of_torso(depth);
  EXPECT_TRUE(reach.is_at_edge({203, 63}));
  EXPECT_FALSE(reach.is_at_edge({227, 63}));
  EXPECT_FALSE(reach.is_at_edge({303, 63}));
  EXPECT_FALSE(reach.is_at_edge({190, 200})) << "only wall";
}

TEST(MoverReach, WithoutDepthNothingIsConnected) {
  const MoverReach reach = reach_of_torso(cv::Mat());
  EXPECT_TRUE(std::isinf(reach.distance_m({140, 145})));
  EXPECT_TRUE(reach.is_at_edge({140, 145})) << "no depth says that it is another thing";
  MoverReach unknown(reach_camera(), person_before_wall(), kReachM);
  unknown.add(kTorso, cv::Mat(kTorso.size(), CV_8UC1, cv::Scalar(255)), 0);
  unknown.spread();
  EXPECT_TRUE(std::isinf(unknown.distance_m({150, 80})));
  EXPECT_FALSE(unknown.is_at_edge({150, 80}));
}

}  // namespace
}  // namespace semvslam
