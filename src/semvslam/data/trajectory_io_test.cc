#include "semvslam/data/trajectory_io.h"

#include <gmock/gmock.h>

#include <random>

#include "semvslam/data/data_test_support.h"

namespace semvslam {
namespace {

using namespace testing_support;
using ::testing::HasSubstr;

std::string trajectory_error(const std::string& text) {
  const Result<ParsedTrajectory> parsed = parse_trajectory(text, "gt.txt");
  return parsed ? "" : parsed.error().message;
}

Trajectory random_trajectory(std::size_t count) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Trajectory trajectory;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
    trajectory.push_back({{1305031102175304001 + static_cast<std::int64_t>(i) * 33333333},
                          SE3(q, {normal(random), 10 * normal(random), normal(random)})});
  }
  return trajectory;
}

TEST(ParseTrajectory, ReadsThePoseConvention) {
  const Result<ParsedTrajectory> parsed =
      parse_trajectory("# head\r\n2.5 1 2 3 0 0 0.7071067811865476 0.7071067811865476\r\n", "x");
  ASSERT_TRUE(parsed.ok());
  ASSERT_EQ(parsed->poses.size(), 1u);
  EXPECT_EQ(parsed->poses[0].stamp.ns, 2500000000);
  // A quarter turn about z takes the camera's x axis to the world's y axis.
  EXPECT_TRUE(
      (parsed->poses[0].world_from_camera * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 3, 3), 1e-12));
}

TEST(ParseTrajectory, NormalisesQuaternions) {
  const Result<ParsedTrajectory> parsed = parse_trajectory("1 0 0 0 0 0 0 2\n", "x");
  EXPECT_DOUBLE_EQ(parsed->poses[0].world_from_camera.rotation().w(), 1);
}

TEST(ParseTrajectory, ErrorsNameTheLineAndTheWord) {
  EXPECT_THAT(trajectory_error("1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n"),
              HasSubstr("gt.txt:2: word 2 is not a finite number"));
  EXPECT_THAT(trajectory_error("1 0 0 0 0 0 0 inf\n"), HasSubstr("gt.txt:1: word 8 is not a finite number"));
  EXPECT_THAT(trajectory_error("NaN 0 0 0 0 0 0 1\n"), HasSubstr("gt.txt:1: the time stamp is not a finite number"));
  EXPECT_THAT(trajectory_error("1 0 0 zero 0 0 0 1\n"), HasSubstr("gt.txt:1: word 4 is not a number"));
  EXPECT_THAT(trajectory_error("1 0 0 0 0 0 0\n"),
              HasSubstr("expected 8 numbers 't tx ty tz qx qy qz qw', got 7 words"));
  EXPECT_THAT(trajectory_error("1 0 0 0 0 0 0 1\n2 0 0"),
              HasSubstr("gt.txt:2: expected 8 numbers 't tx ty tz qx qy qz qw', got 3 words (the file breaks off"));
  EXPECT_THAT(trajectory_error("1 0 0 0 0 0 0 0\n"), HasSubstr("the quaternion has no direction"));
  EXPECT_THAT(trajectory_error("1 0 0 0 1e200 0 0 1\n"), HasSubstr("the quaternion has no direction"));
}

TEST(ParseTrajectory, SortsAndDropsDuplicates) {
  const Result<ParsedTrajectory> parsed = parse_trajectory("2 2 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 9 0 0 0 0 0 1\n", "x");
  ASSERT_TRUE(parsed.ok());
  ASSERT_EQ(parsed->poses.size(), 2u);
  EXPECT_EQ(parsed->poses[0].world_from_camera.translation().x(), 1);
  EXPECT_EQ(parsed->poses[1].world_from_camera.translation().x(), 2) << "the first line of a stamp stays";
  EXPECT_EQ(parsed->out_of_order, 1u);
  EXPECT_EQ(parsed->duplicates, 1u);
}

TEST(TrajectoryFile, IsReadBackWithExactStampsAndNanometres) {
  TemporaryFolder folder;
  const Trajectory written = random_trajectory(50);
  ASSERT_TRUE(write_trajectory(folder / "t.txt", written).ok());
  const Result<Trajectory> read = read_trajectory(folder / "t.txt");
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ((*read)[i].stamp, written[i].stamp);
    const SE3 difference = (*read)[i].world_from_camera.inverse() * written[i].world_from_camera;
    EXPECT_LT(difference.translation().norm(),
              3e-8);  // half a unit of the ninth decimal, turned by a rotation rounded likewise
    EXPECT_LT(difference.rotation_angle_rad(), 1e-8);
  }
}

TEST(TrajectoryFile, MissingAndEmptyAreErrors) {
  TemporaryFolder folder;
  EXPECT_THAT(read_trajectory(folder / "no.txt").error().message, HasSubstr("no.txt: cannot open: No such file"));
  EXPECT_EQ(read_trajectory(folder / "no.txt").error().code, ErrorCode::kNotFound);
  write_text(folder / "empty.txt", "# nothing\n");
  EXPECT_THAT(read_trajectory(folder / "empty.txt").error().message, HasSubstr("no pose in it"));
  EXPECT_THAT(read_trajectory(folder.path()).error().message, HasSubstr("is not a file"));
}

TEST(AppendingWriter, EveryLineIsInTheFileAtOnce) {
  TemporaryFolder folder;
  const Trajectory trajectory = random_trajectory(5);
  Result<AppendingTrajectoryWriter> writer = AppendingTrajectoryWriter::create(folder / "t.txt");
  ASSERT_TRUE(writer.ok());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    ASSERT_TRUE(writer->append(trajectory[i]).ok());
    EXPECT_EQ(read_trajectory(folder / "t.txt")->size(), i + 1);  // through another descriptor, nothing closed
  }
}

TEST(AppendingWriter, SaysThatTheDiskIsFullOrTheFolderMissing) {
  TemporaryFolder folder;
  EXPECT_THAT(AppendingTrajectoryWriter::create(folder / "no/t.txt").error().message,
              HasSubstr("cannot write: No such file"));
  EXPECT_THAT(AppendingTrajectoryWriter::create("/dev/full").error().message,
              HasSubstr("/dev/full: cannot write: No space left"));
}

}  // namespace
}  // namespace semvslam
