#include "semvslam/feature/image_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace semvslam {
namespace {

std::vector<std::uint32_t> near(const ImageGrid& grid, float x, float y, float radius) {
  std::vector<std::uint32_t> found(grid.size());
  found.resize(grid.find_near(x, y, radius, found));
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::uint32_t> near_by_search(const std::vector<float>& xs, const std::vector<float>& ys, float x, float y,
                                          float radius) {
  std::vector<std::uint32_t> found;
  for (std::size_t i = 0; i < xs.size(); ++i) {
    if (std::abs(xs[i] - x) <= radius && std::abs(ys[i] - y) <= radius) found.push_back(static_cast<std::uint32_t>(i));
  }
  return found;
}

TEST(ImageGrid, FindsExactlyWhatASearchOfAllPointsFinds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> x(-60, 700), y(-60, 540), radius(0, 90);  // also outside of the image
  std::vector<float> xs, ys;
  for (int i = 0; i < 800; ++i) {
    xs.push_back(x(random));
    ys.push_back(y(random));
  }
  ImageGrid grid;
  for (const int cell_px : {1, 7, 20, 1000}) {
    grid.build(xs, ys, 640, 480, cell_px);
    for (int q = 0; q < 200; ++q) {
      const float qx = x(random), qy = y(random), r = radius(random);
      ASSERT_EQ(near(grid, qx, qy, r), near_by_search(xs, ys, qx, qy, r))
          << cell_px << " " << qx << " " << qy << " " << r;
    }
  }
}

TEST(ImageGrid, BordersOfTheSquareBelongToIt) {
  ImageGrid grid;
  const std::vector<float> xs{10, 12, 12.001f}, ys{10, 8, 10};
  grid.build(xs, ys, 64, 64, 4);
  EXPECT_EQ(near(grid, 10, 10, 2), (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(near(grid, 10, 10, 0), (std::vector<std::uint32_t>{0}));
}

TEST(ImageGrid, RebuildForgetsTheImageBefore) {
  ImageGrid grid;
  grid.build(std::vector<float>{1, 600}, std::vector<float>{1, 400}, 640, 480);
  grid.build(std::vector<float>{50}, std::vector<float>{50}, 64, 64);
  EXPECT_EQ(near(grid, 50, 50, 1000), (std::vector<std::uint32_t>{0}));
  grid.build({}, {}, 64, 64);
  EXPECT_TRUE(near(grid, 50, 50, 1000).empty());
}

TEST(ImageGrid, AnEmptyGridAndAnImageWithoutAreaHaveNoPoints) {
  ImageGrid grid;
  EXPECT_TRUE(near(grid, 0, 0, 10).empty());
  grid.build(std::vector<float>{1}, std::vector<float>{1}, 0, 480);
  EXPECT_TRUE(near(grid, 1, 1, 10).empty());
}

TEST(ImageGrid, ExtremeNumbersAreHarmless) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  ImageGrid grid;
  grid.build(std::vector<float>{kNan, 3e38f, -3e38f, 5}, std::vector<float>{5, 5, 5, 5}, 64, 64);
  EXPECT_EQ(near(grid, 5, 5, 1), (std::vector<std::uint32_t>{3}));
  EXPECT_EQ(near(grid, 5, 5, kInf), (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_TRUE(near(grid, kNan, 5, 10).empty());
  EXPECT_TRUE(near(grid, 5, 5, kNan).empty());
  EXPECT_TRUE(near(grid, 5, 5, -1).empty());
  EXPECT_TRUE(near(grid, 1e30f, -1e30f, 10).empty());
}

TEST(ImageGrid, RefusesWhatMakesNoSense) {
  ImageGrid grid;
  EXPECT_THROW(grid.build(std::vector<float>{1}, {}, 64, 64), std::invalid_argument);
  EXPECT_THROW(grid.build({}, {}, 64, 64, 0), std::invalid_argument);
  grid.build(std::vector<float>{1}, std::vector<float>{1}, 64, 64);
  EXPECT_THROW(grid.find_near(1, 1, 1, {}), std::invalid_argument);
}

}  // namespace
}  // namespace semvslam
