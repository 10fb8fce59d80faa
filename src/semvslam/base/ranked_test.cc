#include "semvslam/base/ranked.h"

#include <gtest/gtest.h>

#include <vector>

namespace semvslam {
namespace {

TEST(Ranked, TheMiddleOneIsTheMedian) {
  std::vector<int> odd = {9, 1, 5}, even = {4, 1, 3, 2}, one = {7};
  EXPECT_EQ(median(std::span(odd)), 5);
  EXPECT_EQ(median(std::span(even)), 3);
  EXPECT_EQ(median(std::span(one)), 7);
}

TEST(Ranked, AQuantileHasItsShareBefore) {
  std::vector<double> values = {9, 8, 7, 6, 5, 4, 3, 2, 1, 0};
  EXPECT_EQ(quantile(std::span(values), 0.), 0);
  EXPECT_EQ(quantile(std::span(values), 0.4), 4);
  EXPECT_EQ(quantile(std::span(values), 0.99), 9);
  EXPECT_EQ(ranked(std::span(values), 3), 3);
}

}  // namespace
}  // namespace semvslam
