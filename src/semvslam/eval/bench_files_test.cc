#include "semvslam/eval/bench_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "semvslam/eval/bench_test_support.h"

namespace semvslam {
namespace {

using ::testing::HasSubstr;
using testing_support::small_bench;

TEST(BenchCsv, HasARowPerRunAndQuotesWhatNeedsIt) {
  BenchResults results = small_bench();
  results.runs[3].failure = "exit code 3: \"a, b\"";
  const std::string csv = to_csv(results);
  std::istringstream lines(csv);
  std::string header, first, line;
  std::getline(lines, header);
  EXPECT_THAT(header, ::testing::StartsWith("sequence,mode,run,failure,ate_rmse_m,"));
  std::getline(lines, first);
  EXPECT_THAT(first, ::testing::StartsWith("walk,orb,1,,0.4,"));
  EXPECT_EQ(std::count(first.begin(), first.end(), ','), std::count(header.begin(), header.end(), ','));
  std::getline(lines, line), std::getline(lines, line), std::getline(lines, line);
  EXPECT_THAT(line, ::testing::StartsWith("walk,full,3,\"exit code 3: \"\"a, b\"\"\",,"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 7);
}

TEST(BenchJson, HoldsEveryRunAndTheSpreads) {
  const auto json = nlohmann::json::parse(to_json(small_bench()));
  ASSERT_EQ(json["runs"].size(), 6u);
  EXPECT_EQ(json["runs"][1]["numbers"]["ate_rmse_m"], 0.006);
  EXPECT_EQ(json["runs"][3]["failure"], "exit code 3: it <b>broke</b>");
  EXPECT_FALSE(json["runs"][3].contains("numbers"));
  EXPECT_EQ(json["summary"][1]["failed"], 1);
  EXPECT_EQ(json["summary"][1]["numbers"]["ate_rmse_m"]["min"], 0.005);
  EXPECT_EQ(json["baseline"], "orb");
}

TEST(BenchJson, BytesThatAreNoTextDoNoHarm) {
  BenchResults results = small_bench();
  results.runs[3].failure = "\xff";
  EXPECT_EQ(nlohmann::json::parse(to_json(results))["runs"][3]["failure"], "\xef\xbf\xbd");
}

TEST(BenchMarkdown, BeginsWithTheMachine) {
  const std::string text = to_markdown(small_bench());
  EXPECT_THAT(text, HasSubstr("## Bench small\n"));
  EXPECT_THAT(text, HasSubstr("| processor | A & B &lt;fast> |"));
  EXPECT_LT(text.find("processor"), text.find("## Summary"));
}

}  // namespace
}  // namespace semvslam
