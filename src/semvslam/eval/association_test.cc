#include "semvslam/eval/association.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace semvslam {
namespace {

Trajectory at_ms(std::initializer_list<int> stamps_ms) {
  Trajectory out;
  for (int ms : stamps_ms) out.push_back({TimeStamp{ms * std::int64_t{1'000'000}}, SE3()});
  return out;
}

std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const Trajectory& reference, const Trajectory& estimate) {
  std::vector<std::pair<std::size_t, std::size_t>> out;
  for (const PosePair& p : pair_by_time(reference, estimate, 0.02)) out.emplace_back(p.reference, p.estimate);
  return out;
}

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(PairByTime, TakesTheNearestWithinTheGap) {
  EXPECT_EQ(pairs_of(at_ms({0, 10, 20, 30, 40, 90}), at_ms({12, 19, 65})), (Pairs{{1, 0}, {2, 1}}));
}

TEST(PairByTime, LimitOfTheGapIsIncluded) {
  EXPECT_EQ(pairs_of(at_ms({0, 100, 200}), at_ms({20, 121})), (Pairs{{0, 0}}));
}

TEST(PairByTime, OfTwoEquallyNearTheEarlierOne) {
  EXPECT_EQ(pairs_of(at_ms({0, 10, 500}), at_ms({5})), (Pairs{{0, 0}}));
}

TEST(PairByTime, StartsFromTheShorterOneWhicheverItIs) {
  EXPECT_EQ(pairs_of(at_ms({11}), at_ms({0, 10, 20})), (Pairs{{0, 1}}));
  EXPECT_EQ(pairs_of(at_ms({0, 10}), at_ms({1, 2})), (Pairs{{0, 0}, {0, 1}}));  // equal lengths: from the estimate
}

TEST(PairByTime, NothingInCommonOrNothingAtAll) {
  EXPECT_TRUE(pairs_of(at_ms({0, 10}), at_ms({1000})).empty());
  EXPECT_TRUE(pairs_of({}, at_ms({1})).empty());
  EXPECT_TRUE(pairs_of(at_ms({1}), {}).empty());
}

TEST(ShareTracked, CountsTheMomentsWithAPose) {
  const Trajectory moments = at_ms({0, 33, 66, 100});
  EXPECT_DOUBLE_EQ(share_tracked(stamps_of(moments), at_ms({0, 34}), 0.005), 0.5);
  EXPECT_DOUBLE_EQ(share_tracked(stamps_of(moments), moments, 0), 1.0);
  EXPECT_EQ(share_tracked(stamps_of(moments), {}, 1), 0.0);
  EXPECT_EQ(share_tracked({}, moments, 1), 0.0);
}

TEST(NearestPose, AtBothEnds) {
  const Trajectory t = at_ms({10, 20, 30});
  EXPECT_EQ(nearest_pose(t, TimeStamp{-5}), 0u);
  EXPECT_EQ(nearest_pose(t, TimeStamp{999'000'000}), 2u);
  EXPECT_EQ(nearest_pose(t, TimeStamp{20'000'000}), 1u);
}

}  // namespace
}  // namespace semvslam
