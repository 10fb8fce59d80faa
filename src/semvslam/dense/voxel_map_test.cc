#include "semvslam/dense/voxel_map.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

namespace semvslam {
namespace {

using testing::HasSubstr;

Camera small_camera() {
  Camera camera;
  camera.width_px = 160, camera.height_px = 120;
  camera.fx_px = camera.fy_px = 150;
  camera.cx_px = 79.5, camera.cy_px = 59.5;
  camera.depth_units_per_m = 1000;
  return camera;
}

/// A wall 2 m before the camera, dark; where there is a box before it, the box is bright.
RgbdFrame wall(const cv::Rect& box = {}, double box_m = 1) {
  RgbdFrame frame;
  frame.depth = cv::Mat(120, 160, CV_16UC1, cv::Scalar(2000));
  frame.colour = cv::Mat(120, 160, CV_8UC3, cv::Scalar(30, 20, 10));
  frame.gray = cv::Mat(120, 160, CV_8UC1, cv::Scalar(20));
  if (!box.empty()) {
    frame.depth(box).setTo(1000 * box_m);
    frame.colour(box).setTo(cv::Scalar(250, 240, 230));
  }
  return frame;
}

std::size_t count_nearer(const std::vector<CloudPoint>& points, float z_m) {
  return static_cast<std::size_t>(
      std::count_if(points.begin(), points.end(), [&](const CloudPoint& p) { return p.position_m.z() < z_m; }));
}

TEST(VoxelMap, AWallBecomesOnePointPerVoxelWithItsColour) {
  DenseOptions options;
  options.voxel_m = 0.05;
  VoxelMap map(small_camera(), options);
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  const std::vector<CloudPoint> points = map.points();
  // The wall is 2.1 by 1.6 m, less its rim of one pixel.
  EXPECT_NEAR(static_cast<double>(points.size()), 42 * 32, 150);
  std::set<std::tuple<int, int, int>> cells;
  for (const CloudPoint& p : points) {
    EXPECT_NEAR(p.position_m.z(), 2, 1e-4);
    EXPECT_EQ(p.rgb, (std::array<std::uint8_t, 3>{10, 20, 30}));
    const auto cell = [&](int axis) { return static_cast<int>(std::floor((p.position_m[axis] + 1e-6) / 0.05)); };
    cells.insert({cell(0), cell(1), cell(2)});
  }
  EXPECT_EQ(cells.size(), points.size());
}

TEST(VoxelMap, PointsStandInTheWorld) {
  VoxelMap map(small_camera(), {});
  const SE3 pose(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY())), {5, -1, 3});
  ASSERT_TRUE(map.integrate(wall(), {}, pose));
  for (const CloudPoint& p : map.points()) {
    ASSERT_NEAR(p.position_m.x(), 7, 1e-3);  // it looks along x
    ASSERT_NEAR(p.position_m.z(), 3, 1.1);
  }
}

TEST(VoxelMap, WhatMovesIsLeftOutWithAMargin) {
  const cv::Rect box(60, 40, 40, 40);
  RgbdFrame frame = wall();
  frame.colour(box).setTo(cv::Scalar::all(255));  // at the wall's depth: only the mask tells
  cv::Mat moving = cv::Mat::zeros(120, 160, CV_8UC1);
  moving(box).setTo(255);
  VoxelMap map(small_camera(), {});
  ASSERT_TRUE(map.integrate(frame, moving, SE3()));
  const double half_m = 26 * 2. / 150;  // the box and six pixels
  for (const CloudPoint& p : map.points()) {
    EXPECT_NE(p.rgb[0], 255);
    EXPECT_TRUE(std::abs(p.position_m.x()) > half_m - .02 || std::abs(p.position_m.y()) > half_m - .02);
  }
}

TEST(VoxelMap, AGhostGoesWhenOthersLookThroughItAndTheWallBehindItStays) {
  VoxelMap map(small_camera(), {});
  ASSERT_TRUE(map.integrate(wall({60, 40, 40, 40}), {}, SE3()));
  EXPECT_GT(count_nearer(map.points(), 1.5f), 500u);
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  EXPECT_GT(count_nearer(map.points(), 1.5f), 500u);  // one view may be wrong
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  const std::vector<CloudPoint> points = map.points();
  EXPECT_EQ(count_nearer(points, 1.5f), 0u);
  // In its middle too, where the first frame saw the box.
  EXPECT_TRUE(std::any_of(points.begin(), points.end(), [](const CloudPoint& p) {
    return std::abs(p.position_m.x()) < .05f && std::abs(p.position_m.y()) < .05f;
  }));
}

TEST(VoxelMap, TheOctreeIsOccupiedWherePointsAreAndFreeBeforeThem) {
  VoxelMap map(small_camera(), {});
  ASSERT_TRUE(map.integrate(wall({60, 40, 40, 40}), {}, SE3()));
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  // The box lies in the layer that begins at 1 m, the wall in that at 2 m. What one key frame looked through is not yet
  // taken from the points, and occupied.
  const auto cubes = [&](int z, bool occupied) {
    std::set<OctreeCode> layer;
    for (int x = -30; x < 30; ++x)
      for (int y = -30; y < 30; ++y) layer.insert(octree_code({x, y, z}).value());
    return std::ranges::count_if(map.octree(map.points()), [&](const OctreeLeaf& leaf) {
      return leaf.occupied == occupied && layer.contains(leaf.code);
    });
  };
  const auto box = cubes(20, true), beside = cubes(20, false), wall_cubes = cubes(40, true);
  EXPECT_NEAR(static_cast<double>(box), 5 * 5, 12);  // 0.27 m less its edges
  EXPECT_NEAR(static_cast<double>(wall_cubes), 43 * 33, 100);
  EXPECT_EQ(cubes(40, false), 0);
  EXPECT_NEAR(static_cast<double>(box + beside), 21 * 16, 40);
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  EXPECT_EQ(cubes(20, true), 0);
  EXPECT_EQ(cubes(20, false), box + beside);
}

TEST(VoxelMap, WhatStaysForLongIsNotTakenAwayByTwoWrongViews) {
  VoxelMap map(small_camera(), {});
  for (int k = 0; k < 6; ++k) ASSERT_TRUE(map.integrate(wall({60, 40, 40, 40}), {}, SE3()));
  for (int k = 0; k < 2; ++k) ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  EXPECT_GT(count_nearer(map.points(), 1.5f), 500u);
}

TEST(VoxelMap, UnmeasuredDepthSaysNothingAboutFreeSpace) {
  VoxelMap map(small_camera(), {});
  ASSERT_TRUE(map.integrate(wall({60, 40, 40, 40}), {}, SE3()));
  RgbdFrame blind = wall();
  blind.depth.setTo(0);
  for (int k = 0; k < 5; ++k) ASSERT_TRUE(map.integrate(blind, {}, SE3()));
  EXPECT_GT(count_nearer(map.points(), 1.5f), 500u);
}

TEST(VoxelMap, DepthEdgesAndWhatIsTooFarAreLeftOut) {
  DenseOptions options;
  options.max_depth_m = 1.9;
  VoxelMap map(small_camera(), options);
  ASSERT_TRUE(map.integrate(wall({60, 40, 40, 40}), {}, SE3()));
  const double half_m = 19 / 150.;  // of the box at 1 m without its outermost pixels
  const std::vector<CloudPoint> points = map.points();
  EXPECT_GT(points.size(), 500u);
  for (const CloudPoint& p : points) {
    EXPECT_NEAR(p.position_m.z(), 1, 1e-3);
    EXPECT_LE(std::abs(p.position_m.x()), half_m + 1e-3);
  }
}

TEST(VoxelMap, RareVoxelsGoWhereSeveralFramesAreWanted) {
  DenseOptions options;
  options.least_frames = 2;
  VoxelMap map(small_camera(), options);
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  EXPECT_TRUE(map.points().empty());
  ASSERT_TRUE(map.integrate(wall(), {}, SE3()));
  EXPECT_FALSE(map.points().empty());
}

TEST(VoxelMap, APointHasTheLabelThatMostKeyFramesSawThere) {
  // Side by side: seen as a 7 by two of three frames, by one of them, as a 7 by one and as a 9 by two, never.
  const std::array<cv::Rect, 4> parts{cv::Rect(0, 0, 40, 120), {40, 0, 40, 120}, {80, 0, 40, 120}, {120, 0, 40, 120}};
  const std::array<std::array<int, 4>, 3> labels{{{7, 7, 7, 0}, {7, 0, 9, 0}, {0, 0, 9, 0}}};
  VoxelMap map(small_camera(), {});
  for (const auto& of_parts : labels) {
    cv::Mat image(120, 160, CV_8UC1);
    for (std::size_t k = 0; k < parts.size(); ++k) image(parts[k]).setTo(of_parts[k]);
    ASSERT_TRUE(map.integrate(wall(), {}, SE3(), image));
  }
  std::array<std::size_t, 4> points{};
  for (const CloudPoint& p : map.points()) {
    const double column = 79.5 + 75 * static_cast<double>(p.position_m.x());
    if (std::abs(std::remainder(column, 40)) < 2) continue;  // the voxel may belong to two parts
    const auto part = static_cast<std::size_t>(column / 40);
    ++points[part];
    ASSERT_EQ(p.label, (std::array<int, 4>{7, 0, 9, 0}[part])) << p.position_m.transpose();
  }
  for (const std::size_t count : points) EXPECT_GT(count, 3000u);
}

TEST(VoxelMap, LabelsChangeNothingElse) {
  DenseOptions coarse;
  coarse.voxel_m = .05;
  VoxelMap plain(small_camera(), coarse), labelled(small_camera(), coarse);
  cv::Mat image = cv::Mat::zeros(120, 160, CV_8UC1);
  image(cv::Rect(50, 30, 33, 41)).setTo(3);
  for (int k = 0; k < 2; ++k) {
    ASSERT_TRUE(plain.integrate(wall({60, 40, 40, 40}), {}, SE3()));
    ASSERT_TRUE(labelled.integrate(wall({60, 40, 40, 40}), {}, SE3(), image));
  }
  const std::vector<CloudPoint> a = plain.points(), b = labelled.points();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_LT((a[k].position_m - b[k].position_m).norm(), 1e-5f);
    ASSERT_EQ(a[k].rgb, b[k].rgb);
  }
}

TEST(VoxelMap, DepthInMetresWithNanAndGreyPictures) {
  RgbdFrame frame = wall();
  frame.depth.convertTo(frame.depth, CV_32F, 1e-3);
  frame.depth.rowRange(0, 60).setTo(std::numeric_limits<float>::quiet_NaN());
  frame.colour = cv::Mat();
  VoxelMap map(small_camera(), {});
  ASSERT_TRUE(map.integrate(frame, {}, SE3()));
  const std::vector<CloudPoint> points = map.points();
  EXPECT_GT(points.size(), 1000u);
  for (const CloudPoint& p : points) {
    ASSERT_GT(p.position_m.y(), 0);
    ASSERT_EQ(p.rgb[0], 20);
  }
}

TEST(VoxelMap, WhatDoesNotFitIsRefusedAndAddsNothing) {
  VoxelMap map(small_camera(), {});
  RgbdFrame frame = wall();
  const Status mask = map.integrate(frame, cv::Mat::zeros(10, 10, CV_8UC1), SE3());
  ASSERT_FALSE(mask);
  EXPECT_THAT(mask.error().message, HasSubstr("size"));
  EXPECT_FALSE(map.integrate(frame, {}, SE3(), cv::Mat::zeros(10, 10, CV_8UC1)));
  EXPECT_FALSE(map.integrate(frame, {}, SE3(), cv::Mat::zeros(120, 160, CV_16UC1)));
  frame.depth.convertTo(frame.depth, CV_8U);
  EXPECT_FALSE(map.integrate(frame, {}, SE3()));
  frame.depth = wall().depth.rowRange(0, 50);
  EXPECT_FALSE(map.integrate(frame, {}, SE3()));
  EXPECT_FALSE(map.integrate(wall(), {}, SE3(Eigen::Quaterniond::Identity(), {NAN, 0, 0})));
  EXPECT_EQ(map.frames(), 0u);
  EXPECT_TRUE(map.points().empty());
  // Too far away for its voxels to be numbered: nothing, and no harm.
  ASSERT_TRUE(map.integrate(wall(), {}, SE3(Eigen::Quaterniond::Identity(), {1e9, 0, 0})));
  EXPECT_TRUE(map.points().empty());
}

TEST(DenseOptions, NearerThanTheFarthestDepthMustRemain) {
  DenseOptions options;
  EXPECT_TRUE(options.check());
  options.min_depth_m = options.max_depth_m;
  EXPECT_FALSE(options.check());
}

}  // namespace
}  // namespace semvslam
