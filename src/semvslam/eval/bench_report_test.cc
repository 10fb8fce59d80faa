#include "semvslam/eval/bench_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "semvslam/eval/bench_test_support.h"

namespace semvslam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing_support::small_bench;

/// Five seconds on a circle, and an estimate that is off by `error_m` upwards and downwards in turns.
DrawnRun drawn_run(const std::string& mode, double error_m) {
  Trajectory truth, estimate;
  for (int i = 0; i < 150; ++i) {
    const TimeStamp stamp{i * std::int64_t{33'333'333}};
    const SE3 pose(Eigen::Quaterniond::Identity(), {std::cos(0.03 * i), std::sin(0.03 * i), 0});
    truth.push_back({stamp, pose});
    estimate.push_back(
        {stamp, SE3(pose.rotation(), pose.translation() + Eigen::Vector3d(0, 0, i % 2 ? error_m : -error_m))});
  }
  Result<Evaluation> evaluation = evaluate(truth, estimate, {});
  EXPECT_TRUE(evaluation);
  return {mode, 2, std::move(*evaluation)};
}

std::vector<DrawnSequence> drawn(const std::string& name) {
  DrawnSequence sequence{name, {}};
  sequence.runs.push_back(drawn_run("orb", 0.3));
  sequence.runs.push_back(drawn_run("full", 0.004));
  std::vector<DrawnSequence> out;
  out.push_back(std::move(sequence));
  return out;
}

TEST(BenchReport, NeedsNoScriptAndNoOtherFile) {
  const std::string html = to_html(small_bench(), drawn("walk"));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  for (const char* word : {"<script", "<link", "<img", "url(", "src=\"", "href="})
    EXPECT_THAT(html, Not(HasSubstr(word)));
  EXPECT_THAT(html, ::testing::EndsWith("</html>\n"));
}

TEST(BenchReport, ForeignTextIsEscapedEverywhere) {
  const std::string evil = "\"><script>alert(1)</script>";
  BenchResults results = small_bench();
  results.name = evil;
  results.sequences[0] = evil;
  for (BenchRun& run : results.runs)
    if (run.sequence == "walk") run.sequence = evil;
  results.runs[3].failure = evil;
  results.facts = {{evil, evil}};
  results.remarks = {evil};
  results.broken_limits = {evil};
  const std::string html = to_html(results, drawn(evil));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, HasSubstr("&quot;&gt;&lt;script&gt;"));
}

TEST(BenchReport, SaysAtTheTopWhatWentWrong) {
  BenchResults results = small_bench();
  results.broken_limits = {"a", "b"};
  const std::string html = to_html(results, {});
  EXPECT_THAT(html, HasSubstr("Failed runs: 1 of 6"));
  EXPECT_THAT(html, HasSubstr("Broken limits: 2"));
  EXPECT_LT(html.find("Failed runs:"), html.find("<h2>Summary"));
}

TEST(BenchReport, WithoutAnyScoreThereAreTablesOnly) {
  BenchResults results = small_bench();
  for (BenchRun& run : results.runs) run.score.reset();
  const std::string html = to_html(results, {});
  EXPECT_THAT(html, Not(HasSubstr("<svg")));
  EXPECT_THAT(html, HasSubstr("<h2>Summary"));
}

TEST(BenchFigures, ErrorsThatDifferMuchShareALogarithmicAxis) {
  const std::vector<DrawnSequence> far = drawn("walk");
  EXPECT_THAT(draw_errors_over_time(far[0]), HasSubstr("mm, logarithmic"));
  DrawnSequence near{"rest", {}};
  near.runs.push_back(drawn_run("orb", 0.004));
  near.runs.push_back(drawn_run("full", 0.005));
  EXPECT_THAT(draw_errors_over_time(near), Not(HasSubstr("logarithmic")));
}

TEST(BenchFigures, TrajectoriesAreDrawnInTheWidestPlane) {
  const std::string svg = draw_trajectories(drawn("walk")[0]);
  EXPECT_THAT(svg, HasSubstr("x (m)"));
  EXPECT_THAT(svg, HasSubstr("y (m)"));
  EXPECT_THAT(svg, Not(HasSubstr("z (m)")));
  EXPECT_THAT(svg, HasSubstr("full: ATE RMSE 4.00 mm"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(BenchFigures, ThereIsABarForEveryCellWithAScore) {
  const std::vector<std::string> bars = draw_error_bars(small_bench());
  ASSERT_EQ(bars.size(), 6u);
  EXPECT_THAT(bars[0], HasSubstr("absolute trajectory error, RMSE"));
  for (const char* value : {">400<", ">5.50<", ">5.10<", ">4.90<"}) EXPECT_THAT(bars[0], HasSubstr(value));
}

}  // namespace
}  // namespace semvslam
