#include "semvslam/eval/bench_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "semvslam/eval/bench_test_support.h"

namespace semvslam {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing_support::bench_run;
using testing_support::small_bench;

const Table* find_table(const std::vector<Table>& tables, const std::string& title) {
  const auto it = std::find_if(tables.begin(), tables.end(),
                               [&](const Table& t) { return t.title.find(title) != std::string::npos; });
  return it == tables.end() ? nullptr : &*it;
}

TEST(BenchTables, RowsAreAsWideAsTheirHeadings) {
  BenchResults results = small_bench();
  results.sequences[0] = "fr3_walking_xyz";
  for (BenchRun& run : results.runs)
    if (run.sequence == "walk") run.sequence = "fr3_walking_xyz";
  results.broken_limits = {"x"};
  const std::vector<Table> tables = bench_tables(results);
  EXPECT_EQ(tables.size(), 10u) << "all kinds";
  for (const Table& table : tables)
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.columns.size()) << table.title;
}

TEST(BenchTables, SummaryShowsMedianRangeAndWhatIsMissing) {
  const Table table = summary_table(small_bench());
  ASSERT_EQ(table.rows.size(), 4u);
  EXPECT_THAT(table.rows[0],
              ElementsAre("walk", "orb", "1", "0", "400", "75.0", "50", "5.00", "8.00", "60.0", "12.0", "90.0"));
  EXPECT_THAT(table.rows[1], ElementsAre("walk", "full", "3", "1", "5.50 (5.00-6.00)", "100.0", "0", "5.00", "8.00",
                                         "60.0", "12.0", "90.0"));
}

TEST(BenchTables, ImprovementIsOverTheBaselineOfTheSameSequence) {
  const std::vector<Table> tables = bench_tables(small_bench());
  const Table* ate = find_table(tables, "Absolute trajectory error");
  ASSERT_NE(ate, nullptr);
  EXPECT_THAT(ate->rows[0], ElementsAre("walk", "orb", "400", "360", "320", "160", "75.0", "", "", "2.50", "16.00"));
  EXPECT_THAT(ate->rows[1],
              ElementsAre("walk", "full", "5.50", "4.95", "4.40", "2.20", "100.0", "98.62", "98.62", "2.50", "0.22"));
  EXPECT_EQ(ate->rows[3][7], "3.92");
  const Table* rotation = find_table(tables, "rotation, degrees (as the paper's Table V)");
  ASSERT_NE(rotation, nullptr);
  EXPECT_EQ(rotation->rows[0][2], "4.00") << "degrees are not scaled";
}

TEST(BenchTables, WithoutABaselineThereIsNoImprovement) {
  BenchResults results = small_bench();
  results.baseline.clear();
  for (const Table& table : bench_tables(results)) EXPECT_THAT(table.columns, Not(Contains(HasSubstr("improvement"))));
}

TEST(BenchTables, AShareTrackedBelowAllStandsBesideTheError) {
  const std::vector<Table> tables = bench_tables(small_bench());
  const Table* across = find_table(tables, "across modes");
  ASSERT_NE(across, nullptr);
  ASSERT_EQ(across->rows.size(), 2u) << "nothing published: none of these is one of the paper's recordings";
  EXPECT_THAT(across->rows[0], ElementsAre("semvslam, orb", "this machine", "400 [75.0 %]", "5.10"));
  EXPECT_THAT(across->rows[1], ElementsAre("semvslam, full", "this machine", "5.50", "4.90"));
}

TEST(BenchTables, PublishedNumbersStandBesideThePapersRecordingsAndSayWhoseTheyAre) {
  BenchResults results;
  results.sequences = {"rgbd_dataset_freiburg3_walking_xyz", "kitchen"};
  results.modes = {"full"};
  results.runs = {bench_run(results.sequences[0], "full", 1, 0.014), bench_run("kitchen", "full", 1, 0.005)};
  const std::vector<Table> tables = bench_tables(results);
  const Table* across = find_table(tables, "across modes");
  ASSERT_NE(across, nullptr);
  EXPECT_THAT(across->rows, Contains(ElementsAre("DynaSLAM", "published, other machine", "16.4", "")));
  const Table* time = find_table(tables, "Time per frame");
  ASSERT_NE(time, nullptr);
  EXPECT_THAT(time->rows,
              Contains(ElementsAre("ORB-SLAM2", "published, other machine", HasSubstr("i9"), "37.51", "", "", "")));
  const Table* relative = find_table(tables, "published, other machine");
  ASSERT_NE(relative, nullptr);
  EXPECT_EQ(relative->rows.size(), 3u);
}

TEST(BenchTables, FeaturesAreInPercentAndOnlyWhereTrueMasksWere) {
  const std::vector<Table> tables = bench_tables(small_bench());
  const Table* truth = find_table(tables, "Features on moving things");
  ASSERT_NE(truth, nullptr);
  EXPECT_THAT(truth->rows, ElementsAre(ElementsAre("walk", "full", "1.0", "0.2", "3.0", "0.4", "20.0")));
}

TEST(BenchTables, FailedRunsAreNamed) {
  const std::vector<Table> tables = bench_tables(small_bench());
  const Table* failed = find_table(tables, "Failed runs");
  ASSERT_NE(failed, nullptr);
  EXPECT_THAT(failed->rows, ElementsAre(ElementsAre("walk", "full", "3", "exit code 3: it <b>broke</b>")));
}

TEST(BenchTables, ACellWhereAllRunsFailedKeepsItsRow) {
  BenchResults results = small_bench();
  for (BenchRun& run : results.runs) run.failure = "killed by signal 9";
  const Table table = summary_table(results);
  ASSERT_EQ(table.rows.size(), 4u);
  EXPECT_THAT(table.rows[0], ElementsAre("walk", "orb", "1", "1", "", "", "", "", "", "", "", ""));
}

}  // namespace
}  // namespace semvslam
