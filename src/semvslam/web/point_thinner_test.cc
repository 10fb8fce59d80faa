#include "semvslam/web/point_thinner.h"

#include <gtest/gtest.h>

#include <limits>

namespace semvslam {
namespace {

PlyVertex at(float x, float y, float z) { return {{x, y, z}, {}}; }

/// A floor of 10 by 10 m with a point per centimetre in one corner square metre and per decimetre elsewhere.
void add_floor(PointThinner& thinner) {
  for (int i = 0; i < 100; ++i)
    for (int k = 0; k < 100; ++k) {
      thinner.add(at(0.1f * static_cast<float>(i), 0.1f * static_cast<float>(k), 1));
      thinner.add(at(0.01f * static_cast<float>(i), 0.01f * static_cast<float>(k), 1));
    }
}

TEST(PointThinner, FewPointsAreAllKeptInTheirOrder) {
  PointThinner thinner(3);
  for (const float x : {2.f, 1.f, 2.f}) thinner.add(at(x, 0, 0));
  ASSERT_EQ(thinner.points().size(), 3);
  EXPECT_EQ(thinner.cell_m(), 0);
  EXPECT_EQ(thinner.points()[1].position_m.x(), 1);
}

TEST(PointThinner, ManyAreThinnedEvenlyAndKeepTheirBounds) {
  constexpr std::size_t kMost = 5000;
  PointThinner thinner(kMost);
  add_floor(thinner);
  EXPECT_EQ(thinner.given(), 20'000);
  EXPECT_LE(thinner.points().size(), kMost);
  EXPECT_GT(thinner.points().size(), kMost / 3);
  Eigen::Vector3f low = thinner.points().front().position_m, high = low;
  std::size_t in_corner = 0;
  for (const PlyVertex& p : thinner.points()) {
    low = low.cwiseMin(p.position_m), high = high.cwiseMax(p.position_m);
    in_corner += p.position_m.x() < 1 && p.position_m.y() < 1;
  }
  const auto cell_m = static_cast<float>(thinner.cell_m());
  EXPECT_GT(cell_m, 0);
  EXPECT_LE((low - Eigen::Vector3f(0, 0, 1)).cwiseAbs().maxCoeff(), cell_m);
  EXPECT_LE((high - Eigen::Vector3f(9.9f, 9.9f, 1)).cwiseAbs().maxCoeff(), cell_m);
  // Half of the points were in a hundredth of the floor.
  EXPECT_LT(in_corner, thinner.points().size() / 20);
}

TEST(PointThinner, PointsInOnePlaceBecomeOne) {
  PointThinner thinner(10);
  for (int i = 0; i < 1000; ++i) thinner.add(at(1, 2, 3));
  EXPECT_EQ(thinner.points().size(), 1);
}

TEST(PointThinner, NegativeAndFarPlacesHaveCellsOfTheirOwn) {
  PointThinner thinner(4);
  for (int i = 0; i < 100; ++i)
    for (const float x : {-PointThinner::kFarthest_m, -0.001f, 0.001f, PointThinner::kFarthest_m})
      thinner.add(at(x, x, x));
  EXPECT_EQ(thinner.points().size(), 4);
}

TEST(PointThinner, WhatIsNoPlaceIsCountedAndLeftOut) {
  PointThinner thinner(10);
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  for (const PlyVertex& p : {at(nan, 0, 0), at(0, infinite, 0), at(0, 0, 1e30f), at(0, 0, -1001), at(0, 0, 1)})
    thinner.add(p);
  EXPECT_EQ(thinner.points().size(), 1);
  EXPECT_EQ(thinner.unusable(), 4);
  EXPECT_EQ(thinner.given(), 5);
}

}  // namespace
}  // namespace semvslam
