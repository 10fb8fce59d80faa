#include "semvslam/apps/run_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "semvslam/base/temporary_folder_test_support.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;

class RunOutputTest : public ::testing::Test {
 protected:
  std::string content(const std::string& name) const {
    std::ifstream file(out_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static StampedPose pose(double seconds, double x) {
    return {TimeStamp::from_seconds(seconds), SE3(Eigen::Quaterniond::Identity(), {x, 0, 0})};
  }

  const testing_support::TemporaryFolder folder_;
  const fs::path out_ = folder_ / "out";
};

TEST_F(RunOutputTest, PosesAreInTheFileBeforeTheEnd) {
  auto output = RunOutput::create(out_ / "deeper");
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->add_pose(pose(1, 2)));
  EXPECT_THAT(content("deeper/trajectory.txt"), ::testing::HasSubstr("1.000000000 2.000000000"));
}

TEST_F(RunOutputTest, ResultsReplaceThePosesAsTracked) {
  auto output = RunOutput::create(out_);
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->add_pose(pose(1, 2)));
  const std::vector<Eigen::Vector3d> points = {{1, 2, 3}, {4, 5, 6}};
  ASSERT_TRUE(output->write_results({{pose(1, 9)}, {pose(1, 9)}, {}, points}, {}));
  EXPECT_THAT(content("trajectory.txt"), ::testing::HasSubstr("1.000000000 9.000000000"));
  EXPECT_THAT(content("trajectory.txt"), ::testing::Not(::testing::HasSubstr(" 2.000000000")));
  EXPECT_EQ(content("map.ply"), format_ply(points));
}

TEST_F(RunOutputTest, NoFileHoldsPosesOfTwoWorlds) {
  auto output = RunOutput::create(out_);
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->add_pose(pose(1, 2)));
  for (const std::uint32_t sub_map : {1, 2}) ASSERT_TRUE(output->add_pose(pose(1 + sub_map, 3), SubMapId(sub_map)));
  EXPECT_THAT(content("trajectory.txt"), ::testing::Not(::testing::HasSubstr("2.000000000 3.0")));
  EXPECT_THAT(content("trajectory.2.txt"), ::testing::HasSubstr("2.000000000 3.000000000"));
  EXPECT_THAT(content("trajectory.3.txt"), ::testing::HasSubstr("3.000000000 3.000000000"));
  // The third is the main one, of which the second has become a part; the first is apart.
  const std::vector<Eigen::Vector3d> points = {{1, 2, 3}};
  ASSERT_TRUE(output->write_results({{pose(2, 7), pose(3, 8)}, {}, {}, {}},
                                    {{SubMapId(0), {{pose(1, 2)}, {pose(1, 2)}, {}, points}}}));
  EXPECT_THAT(content("trajectory.txt"), ::testing::HasSubstr("3.000000000 8.000000000"));
  EXPECT_THAT(content("trajectory.1.txt"), ::testing::HasSubstr("1.000000000 2.000000000"));
  EXPECT_EQ(content("map.1.ply"), format_ply(points));
  EXPECT_TRUE(fs::exists(out_ / "keyframes.1.txt"));
  EXPECT_FALSE(fs::exists(out_ / "trajectory.2.txt"));
  EXPECT_FALSE(fs::exists(out_ / "trajectory.3.txt"));
}

TEST(Numbered, TheNumberStandsBeforeTheExtension) {
  EXPECT_EQ(numbered("a/room.map", SubMapId(1)), "a/room.2.map");
  EXPECT_EQ(numbered("room", SubMapId(9)), "room.10");
}

TEST_F(RunOutputTest, EarlierResultsAreRemoved) {
  fs::create_directories(out_);
  std::ofstream(out_ / "stats.json") << "old";
  for (const char* name : {"trajectory.2.txt", "map.12.ply", "dense.ply"}) std::ofstream(out_ / name) << "old";
  for (const char* name : {"mine.txt", "mine.2.txt", "trajectory.old.txt", "map.2.txt"})
    std::ofstream(out_ / name) << "kept";
  ASSERT_TRUE(RunOutput::create(out_));
  for (const char* name : {"stats.json", "trajectory.2.txt", "map.12.ply", "dense.ply"})
    EXPECT_FALSE(fs::exists(out_ / name)) << name;
  for (const char* name : {"mine.txt", "mine.2.txt", "trajectory.old.txt", "map.2.txt"})
    EXPECT_TRUE(fs::exists(out_ / name)) << name;
}

TEST_F(RunOutputTest, AFileInPlaceOfTheFolderIsAnError) {
  std::ofstream(out_) << "a file";
  const auto output = RunOutput::create(out_);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::kIo);
  EXPECT_THAT(output.error().message, ::testing::HasSubstr(out_.string()));
}

TEST_F(RunOutputTest, LogLinesCarryLevelAndMessage) {
  auto output = RunOutput::create(out_);
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
