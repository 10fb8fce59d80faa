#include "semvslam/eval/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace semvslam {
namespace {

TEST(ErrorStatistics, OfKnownValues) {
  const std::vector<double> errors = {4, 1, 3, 2};
  const ErrorStatistics s = error_statistics(errors);
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(30.0 / 4));
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.sd, std::sqrt(5.0 / 4));
  EXPECT_DOUBLE_EQ(s.min, 1);
  EXPECT_DOUBLE_EQ(s.max, 4);
}

TEST(ErrorStatistics, OddCountHasAMiddle) {
  const std::vector<double> errors = {9, 1, 2};
  EXPECT_DOUBLE_EQ(error_statistics(errors).median, 2);
}

TEST(ErrorStatistics, EmptyIsAllZero) {
  const ErrorStatistics s = error_statistics({});
  EXPECT_EQ(s.count, 0u);
  EXPECT_EQ(s.rmse, 0.0);
}

TEST(ErrorStatistics, NearlyEqualErrorsKeepTheirSpread) {
  const std::vector<double> errors = {1e6, 1e6 + 1e-3, 1e6 + 2e-3};
  EXPECT_NEAR(error_statistics(errors).sd, 1e-3 * std::sqrt(2.0 / 3), 1e-9);
}

TEST(Spread, IsTheMiddleAndTheEnds) {
  const std::vector<double> values = {7, 3, 5, 4};
  const Spread s = spread_of(values);
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.median, 4.5);
  EXPECT_DOUBLE_EQ(s.min, 3);
  EXPECT_DOUBLE_EQ(s.max, 7);
  EXPECT_EQ(spread_of({}).count, 0u);
}

TEST(Improvement, IsRelativeToTheOther) {
  EXPECT_DOUBLE_EQ(improvement_percent(0.4, 0.1), 75);
  EXPECT_DOUBLE_EQ(improvement_percent(0.1, 0.2), -100);
  EXPECT_EQ(improvement_percent(0, 0), 0);
  EXPECT_EQ(improvement_percent(0, 1), -INFINITY);
}

}  // namespace
}  // namespace semvslam
