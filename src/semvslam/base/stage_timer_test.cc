#include "semvslam/base/stage_timer.h"

#include <gtest/gtest.h>

#include <limits>
#include <thread>

namespace semvslam {
namespace {

TEST(StageTimer, NoCallsGiveZeros) {
  const StageSummary s = StageTimer("track").summary();
  EXPECT_EQ(s.name, "track");
  EXPECT_EQ(s.count, 0u);
  EXPECT_EQ(s.p95_ms, 0.0);
}

TEST(StageTimer, SummaryOfKnownDurations) {
  StageTimer timer("track");
  for (int i = 1; i <= 1000; ++i) timer.add_ms(0.01 * i);  // 0.01 .. 10 ms
  const StageSummary s = timer.summary();
  EXPECT_EQ(s.count, 1000u);
  EXPECT_NEAR(s.mean_ms, 5.005, 1e-9);
  EXPECT_NEAR(s.median_ms, 5.0, 5.0 * 0.01);
  EXPECT_NEAR(s.p95_ms, 9.5, 9.5 * 0.01);
  EXPECT_DOUBLE_EQ(s.max_ms, 10.0);
}

TEST(StageTimer, OneCallIsItsOwnMedianAndMaximum) {
  StageTimer timer("x");
  timer.add_ms(7.3);
  const StageSummary s = timer.summary();
  EXPECT_NEAR(s.median_ms, 7.3, 7.3 * 0.01);
  EXPECT_LE(s.p95_ms, s.max_ms);
  EXPECT_DOUBLE_EQ(s.max_ms, 7.3);
}

TEST(StageTimer, ExtremeDurationsStayInside) {
  StageTimer timer("x");
  timer.add_ms(-1);
  timer.add_ms(std::numeric_limits<double>::quiet_NaN());
  timer.add_ms(1e-9);
  timer.add_ms(1e12);
  const StageSummary s = timer.summary();
  EXPECT_EQ(s.count, 4u);
  EXPECT_LT(s.median_ms, 0.002);
  EXPECT_DOUBLE_EQ(s.max_ms, 1e12);
}

TEST(StageTimer, ScopeAddsOneCall) {
  StageTimer timer("x");
  {
    const auto scope = timer.time();
    EXPECT_GE(scope.elapsed_ms(), 0.0);
    EXPECT_EQ(timer.summary().count, 0u);
  }
  EXPECT_EQ(timer.summary().count, 1u);
}

TEST(StageTimers, KeepsOrderAndReferences) {
  StageTimers timers;
  StageTimer& first = timers["decode"];
  for (int i = 0; i < 100; ++i) timers["stage" + std::to_string(i)].add_ms(1);
  first.add_ms(2);
  EXPECT_EQ(&first, &timers["decode"]);
  const auto all = timers.summaries();
  ASSERT_EQ(all.size(), 101u);
  EXPECT_EQ(all[0].name, "decode");
  EXPECT_DOUBLE_EQ(all[0].max_ms, 2.0);
  EXPECT_EQ(all[100].name, "stage99");
}

TEST(StageTimers, ManyThreadsLoseNothing) {
  StageTimers timers;
  std::vector<std::jthread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 5000; ++i) timers["shared"].add_ms(1);
    });
  threads.clear();
  EXPECT_EQ(timers.summaries().at(0).count, 20000u);
}

}  // namespace
}  // namespace semvslam
