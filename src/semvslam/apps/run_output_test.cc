#include "semvslam/apps/run_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>

namespace semvslam {
namespace {

namespace fs = std::filesystem;

class RunOutputTest : public ::testing::Test {
 protected:
  RunOutputTest()
      : folder_(fs::path(::testing::TempDir()) / ::testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(folder_);
  }
  ~RunOutputTest() override { fs::remove_all(folder_); }

  std::string content(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static StampedPose pose(double seconds, double x) {
    return {TimeStamp::from_seconds(seconds), SE3(Eigen::Quaterniond::Identity(), {x, 0, 0})};
  }

  const fs::path folder_;
};

TEST_F(RunOutputTest, PosesAreInTheFileBeforeTheEnd) {
  auto output = RunOutput::create(folder_ / "deeper");
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->add_pose(pose(1, 2)));
  EXPECT_THAT(content("deeper/trajectory.txt"), ::testing::HasSubstr("1.000000000 2.000000000"));
}

TEST_F(RunOutputTest, ResultsReplaceThePosesAsTracked) {
  auto output = RunOutput::create(folder_);
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->add_pose(pose(1, 2)));
  const std::vector<Eigen::Vector3d> points = {{1, 2, 3}, {4, 5, 6}};
  ASSERT_TRUE(output->write_results({pose(1, 9)}, {pose(1, 9)}, points));
  EXPECT_THAT(content("trajectory.txt"), ::testing::HasSubstr("1.000000000 9.000000000"));
  EXPECT_THAT(content("trajectory.txt"), ::testing::Not(::testing::HasSubstr(" 2.000000000")));
  EXPECT_EQ(content("map.ply"), format_ply(points));
}

TEST_F(RunOutputTest, EarlierResultsAreRemoved) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "stats.json") << "old";
  std::ofstream(folder_ / "mine.txt") << "kept";
  ASSERT_TRUE(RunOutput::create(folder_));
  EXPECT_FALSE(fs::exists(folder_ / "stats.json"));
  EXPECT_TRUE(fs::exists(folder_ / "mine.txt"));
}

TEST_F(RunOutputTest, AFileInPlaceOfTheFolderIsAnError) {
  std::ofstream(folder_) << "a file";
  const auto output = RunOutput::create(folder_);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::kIo);
  EXPECT_THAT(output.error().message, ::testing::HasSubstr(folder_.string()));
}

TEST_F(RunOutputTest, LogLinesCarryLevelAndMessage) {
  auto output = RunOutput::create(folder_);
  ASSERT_TRUE(output);
  output->log("warning", "skipped: x");
  EXPECT_THAT(content("run.log"), ::testing::ContainsRegex("^[0-9-]+ [0-9:.]+ warning skipped: x\n$"));
}

TEST(FormatPly, HoldsFloatsBehindTheHeader) {
  const std::vector<Eigen::Vector3d> points = {{1, 2, 3}, {4, 5, -6}};
  const std::string ply = format_ply(points);
  EXPECT_THAT(ply, ::testing::HasSubstr("element vertex 2\n"));
  const std::size_t body = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size(), body + 24);
  float last = 0;
  std::memcpy(&last, ply.data() + body + 20, 4);
  EXPECT_EQ(last, -6.f);
}

}  // namespace
}  // namespace semvslam
