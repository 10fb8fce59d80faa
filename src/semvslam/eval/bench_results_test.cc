#include "semvslam/eval/bench_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "semvslam/eval/bench_test_support.h"

namespace semvslam {
namespace {

using testing_support::bench_run;
using testing_support::small_bench;

TEST(BenchNumbers, HaveEachANameOfTheirOwn) {
  std::set<std::string_view> names;
  for (const BenchNumber& number : bench_numbers()) EXPECT_TRUE(names.insert(number.name).second) << number.name;
  EXPECT_THROW(bench_number("ate_rmse"), std::logic_error);
}

TEST(BenchNumbers, AreThoseOfTheRun) {
  const BenchRun run = bench_run("s", "full", 1, 0.01);
  EXPECT_EQ(bench_number("ate_rmse_m").of(run), 0.01);
  EXPECT_EQ(bench_number("ate_share_of_way").of(run), 0.004);
  EXPECT_EQ(bench_number("rpe_rotation_sd_deg").of(run), 0.01 * 10 * 0.4);
  EXPECT_EQ(bench_number("tracked_share").of(run), 1.0);
  EXPECT_EQ(bench_number("kept_on_moving").of(run), std::nullopt);
  BenchRun none;
  EXPECT_EQ(bench_number("ate_rmse_m").of(none), std::nullopt);
  EXPECT_EQ(bench_number("ate_share_of_way").of(none), std::nullopt);
  EXPECT_EQ(bench_number("tracked_share").of(none), 0.0);
}

TEST(CellsOf, CountGoodRunsOnlyInNumbers) {
  const BenchResults results = small_bench();
  const std::vector<BenchCell> cells = cells_of(results);
  ASSERT_EQ(cells.size(), 4u);
  EXPECT_EQ(cells[0].sequence + cells[0].mode, "walkorb");
  const BenchCell* full = find_cell(cells, "walk", "full");
  ASSERT_NE(full, nullptr);
  EXPECT_EQ(full->good.size(), 2u);
  EXPECT_EQ(full->failed.size(), 1u);
  const Spread ate = full->over("ate_rmse_m");
  EXPECT_EQ(ate.count, 2u);
  EXPECT_DOUBLE_EQ(ate.median, 0.0055);
  EXPECT_DOUBLE_EQ(ate.max, 0.006);
  EXPECT_EQ(full->over("kept_on_moving").count, 1u);
  EXPECT_EQ(find_cell(cells, "walk", "boxes"), nullptr);
}

TEST(CellsOf, TheMiddleRunHasTheMedianError) {
  BenchResults results = small_bench();
  EXPECT_EQ(find_cell(cells_of(results), "walk", "full")->middle()->number, 2);
  results.runs.push_back(bench_run("walk", "full", 4, 0.0055));
  EXPECT_EQ(find_cell(cells_of(results), "walk", "full")->middle()->number, 4);
  for (BenchRun& run : results.runs) run.score.reset();
  EXPECT_EQ(find_cell(cells_of(results), "walk", "full")->middle(), nullptr);
}

TEST(BrokenLimits, NameWhatIsBroken) {
  using ::testing::ElementsAre;
  using ::testing::HasSubstr;
  BenchRun run = bench_run("walk", "full", 2, 0.02);
  run.tracked = 190;
  EXPECT_TRUE(broken_limits(run, {}).empty());
  EXPECT_TRUE(broken_limits(run, {"", 0.02, 0.01, 0.95}).empty()) << "the limit itself holds";
  EXPECT_THAT(broken_limits(run, {"full", 0.01, std::nullopt, 1.0}),
              ElementsAre(HasSubstr("walk in mode full, run 2: ate_rmse_m is 0.02, more than 0.01"),
                          HasSubstr("tracked_share is 0.95, less than 1")));
  EXPECT_THAT(broken_limits(run, {"", std::nullopt, 0.005, std::nullopt}), ElementsAre(HasSubstr("ate_share_of_way")));
  EXPECT_TRUE(broken_limits(run, {"orb", 0.01, 0.001, 1.0}).empty()) << "another mode";
}

TEST(BrokenLimits, ARunWithoutAScoreBreaksThoseOnIt) {
  BenchRun run = bench_run("walk", "full", 1, 0.02);
  run.score.reset();
  EXPECT_EQ(broken_limits(run, {"", 0.01, std::nullopt, 1.0}).size(), 1u);
  run.failure = "exit code 1";
  EXPECT_TRUE(broken_limits(run, {"", 0.01, std::nullopt, 1.0}).empty()) << "failures are counted by themselves";
}

TEST(BrokenLimits, ANumberThatIsNoneIsNotBelow) {
  const BenchRun run = bench_run("walk", "full", 1, std::nan(""));
  EXPECT_EQ(broken_limits(run, {"", 0.01, std::nullopt, std::nullopt}).size(), 1u);
}

}  // namespace
}  // namespace semvslam
