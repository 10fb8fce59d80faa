#include "semvslam/motion/camera_motion.h"

#include <gtest/gtest.h>

#include "semvslam/motion/motion_test_support.h"

namespace semvslam {
namespace {

using motion_testing::rotation;
using motion_testing::test_camera;
using motion_testing::translation;

// Pairs in a box of the image that move by `to_from` in the camera's frame.
void add_pairs(std::vector<PointPair>& pairs, const cv::Rect& box, double near_m, double far_m, const SE3& to_from,
               int count, Random& random) {
  const Camera camera = test_camera();
  for (int i = 0; i < count; ++i) {
    PointPair pair;
    pair.from_px = {random.uniform(box.x, box.x + box.width), random.uniform(box.y, box.y + box.height)};
    const double z = random.uniform(near_m, far_m);
    const Eigen::Vector3d to = to_from * camera.back_project(pair.from_px, z);
    pair.to_px = camera.project(to) + Eigen::Vector2d(random.normal(0, 0.3), random.normal(0, 0.3));
    pair.from_depth_m = z + random.normal(0, 0.002 * z * z);
    pair.to_depth_m = to.z() + random.normal(0, 0.002 * z * z);
    pairs.push_back(pair);
  }
}

TEST(CameraMotion, AStaticRoomGivesMillimetres) {
  Random random(2, "camera.test");
  std::vector<PointPair> pairs;
  const SE3 truth = rotation(0.01, -0.02, 0.005) * translation(0.02, -0.01, 0.015);
  add_pairs(pairs, {0, 0, 640, 480}, 1, 4, truth, 300, random);
  const CameraMotion motion = estimate_camera_motion(pairs, test_camera(), std::nullopt, {});
  ASSERT_EQ(motion.source, CameraMotionSource::kEstimated);
  const SE3 error = motion.cur_from_prev * truth.inverse();
  EXPECT_LT(error.translation().norm(), 0.002);
  EXPECT_LT(error.rotation_angle_rad(), 0.001);
  EXPECT_GT(motion.support, 0.8);
}

TEST(CameraMotion, ADenseThingDoesNotOutvoteTheRoom) {
  Random random(2, "camera.test");
  std::vector<PointPair> pairs;
  const SE3 truth = translation(0.01, 0, 0), thing = translation(-0.04, 0.01, 0);
  add_pairs(pairs, {0, 0, 640, 480}, 2, 4, truth, 110, random);
  add_pairs(pairs, {200, 100, 200, 300}, 1.5, 1.7, thing, 250, random);  // more points, fewer cells; no hint
  const CameraMotion motion = estimate_camera_motion(pairs, test_camera(), std::nullopt, {});
  ASSERT_EQ(motion.source, CameraMotionSource::kEstimated);
  EXPECT_LT((motion.cur_from_prev.translation() - truth.translation()).norm(), 0.003);
}

TEST(CameraMotion, TheHintDecidesWhenTheThingFillsMostOfTheImage) {
  Random random(2, "camera.test");
  std::vector<PointPair> pairs;
  const SE3 truth = translation(0.01, 0, 0), thing = translation(-0.05, 0, 0);
  add_pairs(pairs, {0, 0, 640, 180}, 2, 4, truth, 120, random);
  add_pairs(pairs, {0, 190, 640, 290}, 1.5, 1.9, thing, 220, random);
  const auto without = estimate_camera_motion(pairs, test_camera(), std::nullopt, {});
  EXPECT_NEAR(without.cur_from_prev.translation().x(), -0.05, 0.005);  // the majority
  const auto with = estimate_camera_motion(pairs, test_camera(), translation(0.012, 0.002, 0), {});
  ASSERT_EQ(with.source, CameraMotionSource::kEstimated);
  EXPECT_NEAR(with.cur_from_prev.translation().x(), 0.01, 0.003);
  EXPECT_GT(with.runner_up, with.support);  // and it says that the choice was against the majority
}

TEST(CameraMotion, FewPointsLeaveTheHint) {
  Random random(2, "camera.test");
  std::vector<PointPair> pairs;
  add_pairs(pairs, {0, 0, 640, 480}, 2, 4, SE3(), 6, random);
  const auto predicted = estimate_camera_motion(pairs, test_camera(), translation(0.01, 0, 0), {});
  EXPECT_EQ(predicted.source, CameraMotionSource::kPredicted);
  EXPECT_EQ(predicted.cur_from_prev.translation().x(), 0.01);
  EXPECT_EQ(estimate_camera_motion(pairs, test_camera(), std::nullopt, {}).source, CameraMotionSource::kNone);
  EXPECT_EQ(estimate_camera_motion({}, test_camera(), std::nullopt, {}).source, CameraMotionSource::kNone);
}

TEST(CameraMotion, PointsWithoutDepthOrWeightAreNotAsked) {
  Random random(2, "camera.test");
  std::vector<PointPair> pairs;
  add_pairs(pairs, {0, 0, 640, 480}, 2, 4, SE3(), 100, random);
  for (std::size_t i = 0; i < pairs.size(); ++i) (i % 2 ? pairs[i].weight : pairs[i].from_depth_m) = 0;
  EXPECT_EQ(estimate_camera_motion(pairs, test_camera(), std::nullopt, {}).source, CameraMotionSource::kNone);
}

}  // namespace
}  // namespace semvslam
