#include "semvslam/web/trajectory_tail.h"

#include <gtest/gtest.h>

#include <fstream>

#include "semvslam/web/run_folder_test_support.h"

namespace semvslam {
namespace {

using testing_support::TemporaryFolder;
using testing_support::write;

class TrajectoryTailTest : public ::testing::Test {
 protected:
  void append(const std::string& text) { std::ofstream(file_, std::ios::app) << text; }
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "trajectory.txt";
  TrajectoryTail tail_{file_};
};

TEST_F(TrajectoryTailTest, TakesWholeLinesAsTheyCome) {
  EXPECT_FALSE(tail_.update());
  EXPECT_TRUE(tail_.poses().empty());
  append("1 0 0 0 0 0 0 1\n2 0 0 0 0");
  EXPECT_TRUE(tail_.update());  // the file is new
  EXPECT_EQ(tail_.poses().size(), 1);
  append(" 0 0 1\n3 5 0 0 0 0 0 1\n");
  EXPECT_FALSE(tail_.update());
  ASSERT_EQ(tail_.poses().size(), 3);
  EXPECT_EQ(tail_.poses()[2].world_from_camera.translation().x(), 5);
  EXPECT_FALSE(tail_.update());
}

TEST_F(TrajectoryTailTest, BeginsAnewWithAnotherFile) {
  append("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  tail_.update();
  write(file_, "1 7 0 0 0 0 0 1\n2 7 0 0 0 0 0 1\n3 7 0 0 0 0 0 1\n");
  EXPECT_TRUE(tail_.update());
  ASSERT_EQ(tail_.poses().size(), 3);
  EXPECT_EQ(tail_.poses()[0].world_from_camera.translation().x(), 7);
  std::filesystem::remove(file_);
  EXPECT_TRUE(tail_.update());
  EXPECT_TRUE(tail_.poses().empty());
}

TEST_F(TrajectoryTailTest, GoesOnAfterWhatIsNoPose) {
  append("1 0 0 0 0 0 0 1\n");
  tail_.update();
  append("not a pose\n");
  EXPECT_TRUE(tail_.update());
  append("3 0 0 0 0 0 0 1\n");
  EXPECT_FALSE(tail_.update());
  EXPECT_EQ(tail_.poses().size(), 1);
}

}  // namespace
}  // namespace semvslam
