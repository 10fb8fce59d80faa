#include "semvslam/eval/svg_axes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace semvslam {
namespace {

TEST(TickPositions, AreRoundNumbersInside) {
  using ::testing::DoubleNear;
  EXPECT_THAT(tick_positions(0, 10, 5), ::testing::ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(tick_positions(-0.13, 0.21, 4), ::testing::ElementsAre(DoubleNear(-0.1, 1e-12), DoubleNear(0, 1e-12),
                                                                     DoubleNear(0.1, 1e-12), DoubleNear(0.2, 1e-12)));
}

TEST(TickPositions, OfAnEmptyRangeAreNone) {
  EXPECT_TRUE(tick_positions(1, 1, 5).empty());
  EXPECT_TRUE(tick_positions(0, INFINITY, 5).empty());
}

std::vector<std::string> labels(const AxisRange& range, int wanted) {
  std::vector<std::string> out;
  for (const AxisTick& tick : axis_ticks(range, wanted)) out.push_back(tick.label);
  return out;
}

TEST(AxisTicks, OfALogarithmicAxisAreDecadesAndMoreWhereTheseAreFew) {
  EXPECT_THAT(labels({0.01, 1000, true}, 4), ::testing::ElementsAre("0.01", "0.1", "1", "10", "100", "1000"));
  EXPECT_THAT(labels({0.5, 20, true}, 5), ::testing::ElementsAre("0.5", "1", "2", "5", "10", "20"));
}

TEST(AxisExtent, OfALogarithmicAxisIsRoundAndPositive) {
  AxisExtent extent(true);
  extent.include({-3, 0, 0.37, NAN, 41});
  const AxisRange range = extent.range();
  EXPECT_NEAR(range.low, 0.2, 1e-12);
  EXPECT_NEAR(range.high, 50, 1e-9);
  EXPECT_NEAR(range.share(0.2), 0, 1e-9);
  EXPECT_NEAR(range.share(50), 1, 1e-9);
  EXPECT_TRUE(std::isnan(range.share(0)));
}

TEST(AxisExtent, WithoutValuesIsStillAnAxis) {
  for (const bool logarithmic : {false, true}) {
    AxisExtent extent(logarithmic);
    extent.include({NAN});
    EXPECT_GT(extent.range().high, extent.range().low);
    extent.include({100});
    EXPECT_GT(extent.range().high, extent.range().low);
  }
}

}  // namespace
}  // namespace semvslam
