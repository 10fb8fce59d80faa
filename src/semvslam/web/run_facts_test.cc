#include "semvslam/web/run_facts.h"

#include <gmock/gmock.h>

namespace semvslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Row = std::vector<std::string>;

constexpr const char* kStatistics = R"json({
  "sequence": "room", "mode": "full", "end": "complete", "frames": 8, "tracked": 6, "lost": 2, "skipped": 0,
  "dynamic": {"features": {"static": 75, "moving": 25, "unknown": 0}, "reasons": {"none": 75, "point_motion": 20, "new_kind": 5},
              "mask_sources": {"none": 0, "segmented": 8}, "fail_open": {"no": 7, "motion": 1}, "masked_share": 0.125},
  "notices": ["the network is missing"], "frames_per_s": 40.0,
  "stages_ms": {"tracking": {"count": 8, "mean": 12.5, "median": 12, "p95": 20, "max": 30}, "odd": 3}})json";
constexpr const char* kEvaluation = R"json({
  "ground_truth": {"file": "/data/room"}, "alignment": "se3", "rpe_delta": "1s",
  "estimate": {"tracked_share": 0.75, "ate_m": {"rmse": 0.005, "mean": 0.004, "median": 0.003, "max": 0.02}}})json";

const Table* find_table(const RunFacts& facts, const std::string& title) {
  for (const Table& table : facts.tables)
    if (table.title == title) return &table;
  return nullptr;
}

Row row_of(const RunFacts& facts, const std::string& title, const std::string& name) {
  if (const Table* table = find_table(facts, title))
    for (const Row& row : table->rows)
      if (row[0] == name) return row;
  return {};
}

TEST(DescribeRun, PutsTheNumbersInWords) {
  const RunFacts facts = describe_run(kStatistics, kEvaluation);
  EXPECT_EQ(row_of(facts, "Run", "frames tracked"), Row({"frames tracked", "6 of 8 (75.0 %)"}));
  EXPECT_EQ(row_of(facts, "Run", "lost"), Row({"lost", "2"}));
  EXPECT_THAT(row_of(facts, "Run", "unusable frames skipped"), IsEmpty());
  EXPECT_EQ(row_of(facts, "Accuracy", "absolute error (ATE), mm"),
            Row({"absolute error (ATE), mm", "5.00", "4.00", "3.00", "20.0"}));
  EXPECT_EQ(row_of(facts, "Features, and why some were left out", "moving: left out"),
            Row({"moving: left out", "25", "25.0 %"}));
  EXPECT_EQ(row_of(facts, "Features, and why some were left out", "its point is seen to move"),
            Row({"its point is seen to move", "20", "20.0 %"}));
  EXPECT_EQ(row_of(facts, "Milliseconds per stage", "tracking, all"),
            Row({"tracking, all", "12.5", "12.0", "20.0", "30.0", "8"}));
  EXPECT_THAT(facts.remarks, ElementsAre("the network is missing"));
  EXPECT_FALSE(facts.is_running);
}

TEST(DescribeRun, KeepsNamesItDoesNotKnow) {
  EXPECT_EQ(row_of(describe_run(kStatistics, ""), "Features, and why some were left out", "new_kind"),
            Row({"new_kind", "5", "5.0 %"}));
}

TEST(DescribeRun, NothingKnownIsNoTable) {
  EXPECT_THAT(describe_run("", "").tables, IsEmpty());
  EXPECT_THAT(describe_run("", "").remarks, IsEmpty());
  EXPECT_THAT(describe_run("{}", "{}").tables, IsEmpty());
}

TEST(DescribeRun, ForeignFilesAreARemarkAndNoCrash) {
  for (const char* foreign : {"[1, 2", "[]", "7", "\xff", "{\"frames\": "})
    EXPECT_THAT(describe_run(foreign, "").remarks, ElementsAre(HasSubstr("stats.json is no JSON"))) << foreign;
  for (const char* foreign :
       {R"({"dynamic": 3, "stages_ms": [1], "notices": "x", "end": 5, "frames": "many", "tracked": null})",
        R"({"dynamic": {"features": {"static": "x"}, "reasons": [[]]}, "stages_ms": {"a": null}, "notices": [1, {}]})"})
    EXPECT_THAT(describe_run(foreign, foreign).remarks, IsEmpty()) << foreign;
}

TEST(DescribeRun, ARunThatGoesOnSaysSo) { EXPECT_TRUE(describe_run(R"({"end": "running"})", "").is_running); }

TEST(CompareRuns, HasARowPerRunAndLeavesGaps) {
  const Table table = compare_runs({"a", "b"}, {kStatistics, ""}, {kEvaluation, "{"});
  ASSERT_EQ(table.rows.size(), 2);
  EXPECT_THAT(table.rows[0], ElementsAre("a", "full", "6 of 8 (75.0 %)", "5.00", "-", "-", "12.5", "40.0"));
  EXPECT_THAT(table.rows[1], ElementsAre("b", "", "", "-", "-", "-", "-", "-"));
}

TEST(NamedGroundTruth, IsTheOneOfTheEvaluation) {
  EXPECT_EQ(named_ground_truth(kEvaluation), "/data/room");
  EXPECT_EQ(named_ground_truth("{}"), std::nullopt);
  EXPECT_EQ(named_ground_truth("no"), std::nullopt);
}

}  // namespace
}  // namespace semvslam
