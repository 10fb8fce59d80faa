#include "semvslam/dense/free_space.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

namespace semvslam {
namespace {

constexpr double kSide_m = 0.05;

Camera lopsided_camera() {
  Camera camera;
  camera.width_px = 160, camera.height_px = 120;
  camera.fx_px = 150, camera.fy_px = 140;
  camera.cx_px = 75, camera.cy_px = 62;
  return camera;
}

/// A slope from 1.2 m on the left to 2.8 m on the right, with a near box on it and a hole beside that.
cv::Mat slope() {
  cv::Mat depth_m(120, 160, CV_32FC1);
  for (int x = 0; x < 160; ++x) depth_m.col(x).setTo(1.2 + .01 * x);
  depth_m(cv::Rect(40, 30, 30, 30)).setTo(.8);
  depth_m(cv::Rect(100, 40, 20, 20)).setTo(0);
  return depth_m;
}

/// The least depth in the blocks that a pixel and `reach_px` around it lie in; 0 outside the image.
double nearest_m(const cv::Mat& depth_m, const Eigen::Vector2d& pixel, double reach_px) {
  const auto whole = [](double v) { return static_cast<int>(std::floor(v)); };
  const cv::Point low(whole(pixel.x() + .5 - reach_px), whole(pixel.y() + .5 - reach_px)),
      high(whole(pixel.x() + .5 + reach_px) + 1, whole(pixel.y() + .5 + reach_px) + 1);
  const cv::Rect image(0, 0, depth_m.cols, depth_m.rows), around = cv::Rect(low, high) & image;
  if (!image.contains(cv::Point(whole(pixel.x() + .5), whole(pixel.y() + .5)))) return 0;
  double least = 0;
  cv::minMaxLoc(depth_m(around), &least);
  return least;
}

class FreeSpaceTest : public testing::Test {
 protected:
  FreeSpaceTest() { options_.octree_m = kSide_m; }

  static bool contains(const std::vector<OctreeCode>& cubes, int x, int y, int z) {
    return std::ranges::binary_search(cubes, octree_code({x, y, z}).value());
  }

  const Camera camera_ = lopsided_camera();
  DenseOptions options_;
};

TEST_F(FreeSpaceTest, CubesAreFreeWhereTheirMiddlesAreSeenThrough) {
  const SE3 pose(Eigen::Quaterniond(Eigen::AngleAxisd(.7, Eigen::Vector3d(.3, -.8, .5).normalized())), {.4, -.3, .2});
  FreeSpace space(camera_, options_);
  space.add(slope(), pose);
  const std::vector<OctreeCode> cubes = space.octree_cubes();
  EXPECT_TRUE(std::ranges::is_sorted(cubes));
  const cv::Mat depth_m = slope();
  std::size_t found = 0, sure = 0;
  for (int x = -70; x < 80; ++x)
    for (int y = -70; y < 70; ++y)
      for (int z = -70; z < 80; ++z) {
        const Eigen::Vector3d p = pose.inverse() * (kSide_m * Eigen::Vector3d(x + .5, y + .5, z + .5));
        const Eigen::Vector2d pixel = camera_.project(p);
        const double back_m = p.z() + kSide_m / 2;
        const bool is_free = contains(cubes, x, y, z);
        found += is_free;
        // Between one block and two around the pixel lies what rounding may decide.
        const bool must_not = p.z() < kSide_m - 1e-6 || nearest_m(depth_m, pixel, 4) < back_m - 1e-4;
        const bool must = p.z() > kSide_m + 1e-6 && nearest_m(depth_m, pixel, 8) > back_m + 1e-4;
        sure += must;
        ASSERT_FALSE(must_not && is_free) << x << " " << y << " " << z;
        ASSERT_TRUE(is_free || !must) << x << " " << y << " " << z;
      }
  EXPECT_EQ(found, cubes.size());
  EXPECT_GT(sure, 3000u);
}

TEST_F(FreeSpaceTest, SeveralViewsAddUp) {
  const cv::Mat wall(120, 160, CV_32FC1, cv::Scalar(2));
  const SE3 back(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY())), {0, 0, 0});
  FreeSpace space(camera_, options_);
  space.add(wall, SE3());
  const std::vector<OctreeCode> one = space.octree_cubes();
  EXPECT_TRUE(contains(one, 0, 0, 20));
  EXPECT_FALSE(contains(one, 0, 0, -20));
  space.add(wall, back);
  space.add(wall, back);
  const std::vector<OctreeCode> both = space.octree_cubes();
  EXPECT_TRUE(contains(both, 0, 0, -20));
  EXPECT_NEAR(static_cast<double>(both.size()), 2. * static_cast<double>(one.size()),
              .02 * static_cast<double>(one.size()));
}

TEST_F(FreeSpaceTest, FreeSpaceReachesAsFarAsTheMapDoes) {
  const cv::Mat hall(120, 160, CV_32FC1, cv::Scalar(50));
  options_.max_depth_m = 3;
  FreeSpace near(camera_, options_);
  near.add(hall, SE3());
  EXPECT_TRUE(contains(near.octree_cubes(), 0, 0, 59));
  EXPECT_FALSE(contains(near.octree_cubes(), 0, 0, 60));
  // However far and fine: 200 cubes.
  options_.max_depth_m = 1000;
  FreeSpace far(camera_, options_);
  far.add(hall, SE3());
  EXPECT_TRUE(contains(far.octree_cubes(), 0, 0, 199));
  EXPECT_FALSE(contains(far.octree_cubes(), 0, 0, 200));
}

TEST_F(FreeSpaceTest, AViewFromFarOutsideTheOctreeMarksNothing) {
  FreeSpace space(camera_, options_);
  space.add(slope(), SE3(Eigen::Quaterniond::Identity(), {1e9, 0, -1e12}));
  EXPECT_TRUE(space.octree_cubes().empty());
}

}  // namespace
}  // namespace semvslam
