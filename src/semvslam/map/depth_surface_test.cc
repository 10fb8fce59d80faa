#include "semvslam/map/depth_surface.h"

#include <gtest/gtest.h>

#include <limits>

namespace semvslam {
namespace {

class DepthSurfaceTest : public ::testing::Test {
 protected:
  DepthSurfaceTest() : depth(240, 320, CV_32FC1, cv::Scalar(2.0)) {
    camera.width_px = 320;
    camera.height_px = 240;
    camera.fx_px = camera.fy_px = 300;
    camera.cx_px = 160;
    camera.cy_px = 120;
  }
  Camera camera;
  cv::Mat depth;
};

TEST_F(DepthSurfaceTest, TellsTheFourCasesApart) {
  EXPECT_EQ(check_surface(camera, depth, {100, 100}, 2.05), SurfaceCheck::kFits);
  EXPECT_EQ(check_surface(camera, depth, {100, 100}, 3.0), SurfaceCheck::kHidden);
  EXPECT_EQ(check_surface(camera, depth, {100, 100}, 1.5), SurfaceCheck::kSeenThrough);
  EXPECT_EQ(check_surface(camera, cv::Mat(), {100, 100}, 2.0), SurfaceCheck::kUnknown);
}

TEST_F(DepthSurfaceTest, AnEdgeOfDepthOrNoMeasurementDecidesNothing) {
  depth(cv::Rect(101, 0, 219, 240)).setTo(4.0);
  EXPECT_EQ(check_surface(camera, depth, {100, 100}, 2.0), SurfaceCheck::kUnknown);
  EXPECT_EQ(check_surface(camera, depth, {100, 100}, 4.0), SurfaceCheck::kUnknown);
  depth.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(check_surface(camera, depth, {100, 100}, 2.0), SurfaceCheck::kUnknown);
  EXPECT_EQ(check_surface(camera, depth, {1, 100}, 2.0), SurfaceCheck::kUnknown) << "at the border";
}

TEST_F(DepthSurfaceTest, LooksAtTheRecordedPixelOfADistortedCamera) {
  camera.distortion.k1 = 0.3;
  const Eigen::Vector2d ideal(280, 200);
  const Eigen::Vector2d recorded = camera.distort(ideal);
  ASSERT_GT((recorded - ideal).norm(), 8);
  depth(cv::Rect(static_cast<int>(recorded.x()) - 3, static_cast<int>(recorded.y()) - 3, 8, 8)).setTo(1.0);
  EXPECT_EQ(check_surface(camera, depth, ideal, 2.0), SurfaceCheck::kHidden);
}

}  // namespace
}  // namespace semvslam
