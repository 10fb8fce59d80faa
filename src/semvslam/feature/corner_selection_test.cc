#include "semvslam/feature/corner_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace semvslam {
namespace {

Corner corner(int x, int y, int score) {
  return {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(score)};
}

bool reading_order(const Corner& a, const Corner& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; }

/// n corners at distinct pixels of the rectangle, in reading order.
std::vector<Corner> scattered(int n, int x0, int y0, int x1, int y1, int low, int high, unsigned seed) {
  std::mt19937 random(seed);
  std::set<std::pair<int, int>> pixels;
  while (static_cast<int>(pixels.size()) < n) {
    pixels.insert({y0 + static_cast<int>(random() % static_cast<unsigned>(y1 - y0)),
                   x0 + static_cast<int>(random() % static_cast<unsigned>(x1 - x0))});
  }
  std::vector<Corner> corners;
  for (const auto& [y, x] : pixels) {
    corners.push_back(corner(x, y, low + static_cast<int>(random() % static_cast<unsigned>(high - low))));
  }
  return corners;
}

TEST(CornerSelector, WeakCornersStayOnlyWhereNothingStrongIs) {
  CornerSelector selector(32);
  std::vector<Corner> corners{corner(3, 3, 10), corner(31, 31, 20), corner(32, 3, 10), corner(40, 40, 19)};
  selector.drop_weak(corners, 64, 64, 20);
  ASSERT_EQ(corners.size(), 3u);  // the first cell has a strong one
  EXPECT_EQ(corners[0].x, 31);
  EXPECT_EQ(corners[1].x, 32);
  EXPECT_EQ(corners[2].x, 40);
}

TEST(CornerSelector, TakesByScoreOverRankInTheCell) {
  CornerSelector selector(32);
  // Cell 0 counts 90, 80/2, 70/3; cell 1 counts 30; cell 2 counts 20.
  const std::vector<Corner> corners{corner(1, 1, 80), corner(5, 1, 90), corner(9, 1, 70), corner(33, 1, 30),
                                    corner(65, 1, 20)};
  std::vector<Corner> out;
  selector.select(corners, 96, 32, 3, 0, out);
  ASSERT_EQ(out.size(), 3u);
  EXPECT_EQ(out[0].score, 80);
  EXPECT_EQ(out[1].score, 90);
  EXPECT_EQ(out[2].score, 30);
  selector.select(corners, 96, 32, 1, 10, out);  // one wanted, the others in the order of what they count
  std::vector<int> scores;
  for (const Corner& c : out) scores.push_back(c.score);
  EXPECT_EQ(scores, (std::vector<int>{90, 80, 30, 70, 20}));
}

TEST(CornerSelector, AStrongRegionDoesNotTakeAll) {
  CornerSelector selector(32);
  std::vector<Corner> corners = scattered(2000, 0, 0, 160, 480, 60, 120, 1);  // a quarter of the image, strong
  const std::vector<Corner> weak = scattered(600, 160, 0, 640, 480, 15, 30, 2);
  corners.insert(corners.end(), weak.begin(), weak.end());
  std::sort(corners.begin(), corners.end(), reading_order);
  std::vector<Corner> out;
  selector.select(corners, 640, 480, 500, 0, out);
  ASSERT_EQ(out.size(), 500u);
  std::set<int> cells;
  for (const Corner& c : out) cells.insert(c.y / 32 * 20 + c.x / 32);
  std::set<int> textured;
  for (const Corner& c : corners) textured.insert(c.y / 32 * 20 + c.x / 32);
  EXPECT_GT(cells.size(), textured.size() * 3 / 4);
  EXPECT_TRUE(std::is_sorted(out.begin(), out.end(), reading_order));
}

TEST(CornerSelector, ConcentratedTextureStillFillsTheBudget) {
  CornerSelector selector(32);
  const std::vector<Corner> corners = scattered(900, 300, 200, 340, 240, 20, 90, 3);
  std::vector<Corner> out;
  selector.select(corners, 640, 480, 800, 0, out);
  EXPECT_EQ(out.size(), 800u);
  selector.select(corners, 640, 480, 5000, 100, out);
  EXPECT_EQ(out.size(), 900u);
}

TEST(CornerSelector, NothingWantedOrNothingThere) {
  CornerSelector selector(32);
  std::vector<Corner> out{corner(1, 1, 1)};
  selector.select({}, 640, 480, 10, 10, out);
  EXPECT_TRUE(out.empty());
  const std::vector<Corner> one{corner(1, 1, 1)};
  out = one;
  selector.select(one, 640, 480, 0, 10, out);
  EXPECT_TRUE(out.empty());
}

TEST(CornerSelector, EveryPixelOfALargeImageHasItsCell) {
  for (const int cell : {8, 31, 32, 100}) {
    CornerSelector selector(cell);
    // A strong corner in the cell of each weak one removes it: fails if a border pixel is counted to the next cell.
    for (const int k : {0, 1, 77, 65000 / cell}) {
      std::vector<Corner> corners{corner(k * cell, 0, 10), corner(k * cell + cell - 1, 0, 30)};
      selector.drop_weak(corners, 65535, 1, 20);
      EXPECT_EQ(corners.size(), 1u) << cell << " " << k;
    }
  }
}

}  // namespace
}  // namespace semvslam
