#include "semvslam/web/viewed_run.h"

#include <gmock/gmock.h>

#include "semvslam/web/run_folder_test_support.h"

namespace semvslam {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing_support::landmark_ply;
using testing_support::RunFolder;
using testing_support::write;

ViewedRun good(Result<ViewedRun> run) {
  EXPECT_TRUE(run) << run.error().message;
  return run ? std::move(*run) : ViewedRun{};
}

TEST(ReadRun, ReadsWhatARunWrote) {
  const RunFolder folder;
  const ViewedRun run = good(read_run(folder.path(), {}));
  EXPECT_EQ(run.name, "run");
  EXPECT_EQ(run.trajectory.size(), RunFolder::kPoses);
  EXPECT_EQ(run.key_frames.size(), 2);
  EXPECT_EQ(run.cloud.what, "landmarks");
  EXPECT_EQ(run.cloud.points.size(), 2);
  EXPECT_THAT(run.remarks, IsEmpty());
  EXPECT_EQ(good(read_run(folder.path() / "", {})).name, "run");
}

TEST(ReadRun, ADenseMapGoesBeforeLandmarksUnlessItIsDamaged) {
  const RunFolder folder;
  write(folder / "dense.ply", landmark_ply({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}));
  EXPECT_EQ(good(read_run(folder.path(), {})).cloud.points.size(), 3);
  write(folder / "dense.ply", landmark_ply({{0, 0, 0}}).substr(0, 150));
  const ViewedRun run = good(read_run(folder.path(), {}));
  EXPECT_EQ(run.cloud.what, "landmarks");
  EXPECT_THAT(run.remarks, ElementsAre(HasSubstr("dense.ply")));
  ViewOptions named;
  named.dense = folder / "dense.ply";
  EXPECT_FALSE(read_run(folder.path(), named));
}

TEST(ReadRun, ScoresARunThatHasATruth) {
  const RunFolder folder;
  folder.add_truth();
  const ViewedRun run = good(read_run(folder.path(), {}));
  ASSERT_TRUE(run.evaluation);
  EXPECT_NEAR(run.evaluation->absolute.statistics_m.rmse, 0, 1e-6);
  EXPECT_EQ(run.truth.size(), RunFolder::kPoses);
}

TEST(ReadRun, ATruthThatHasGoneIsARemarkAndAnotherCanBeNamed) {
  const RunFolder folder;
  const std::filesystem::path truth = folder.add_truth(), moved = truth.string() + ".moved";
  std::filesystem::rename(truth, moved);
  EXPECT_THAT(good(read_run(folder.path(), {})).remarks, ElementsAre(HasSubstr("--truth")));
  ViewOptions options;
  options.truth = moved;
  const ViewedRun run = good(read_run(folder.path(), options));
  EXPECT_TRUE(run.evaluation);
  EXPECT_THAT(run.evaluation_json, HasSubstr("\"rpe_delta\""));
  options.truth = truth;
  EXPECT_FALSE(read_run(folder.path(), options));
}

TEST(ReadRun, WhatIsMissingOrForeignIsARemark) {
  const RunFolder folder;
  for (const char* name : {"map.ply", "keyframes.txt", "stats.json"}) std::filesystem::remove(folder / name);
  EXPECT_THAT(good(read_run(folder.path(), {})).remarks,
              ElementsAre(HasSubstr("stats.json is missing"), HasSubstr("no points")));
  write(folder / "map.ply", "<script>");
  write(folder / "keyframes.txt", "1 2 3\n");
  write(folder / "stats.json", "<script>");
  write(folder / "evaluation.json", "[]");
  const ViewedRun run = good(read_run(folder.path(), {}));
  for (const char* name : {"map.ply", "keyframes.txt", "stats.json", "evaluation.json"})
    EXPECT_THAT(run.remarks, Contains(HasSubstr(name)));
}

TEST(ReadRun, WithoutATrajectoryThereIsNoRun) {
  const RunFolder folder;
  write(folder / "trajectory.txt", "1 nan 0 0 0 0 0 1\n");
  EXPECT_THAT(read_run(folder.path(), {}).error().message, HasSubstr("trajectory.txt:1"));
  std::filesystem::remove(folder / "trajectory.txt");
  EXPECT_THAT(read_run(folder.path(), {}).error().message, HasSubstr("holds no run"));
  EXPECT_THAT(read_run(folder / "none", {}).error().message, HasSubstr("no such folder"));
}

TEST(ReadRun, AnEmptyTrajectoryIsARunThatTrackedNothing) {
  const RunFolder folder;
  folder.add_truth();
  write(folder / "trajectory.txt", "# nothing\n");
  EXPECT_THAT(good(read_run(folder.path(), {})).remarks, ElementsAre("not one frame was tracked"));
}

TEST(ReadRun, ALiveRunMayHaveNothingYetAndIsScoredAtItsEnd) {
  const RunFolder folder;
  folder.add_truth();
  ViewOptions live;
  live.live = true;
  EXPECT_TRUE(good(read_run(folder.path(), live)).evaluation);
  write(folder / "stats.json", R"({"end": "running"})");
  EXPECT_FALSE(good(read_run(folder.path(), live)).evaluation);
  write(folder / "trajectory.txt", "1 0 0 0 0 0 0 1\n2 0 0");
  EXPECT_EQ(good(read_run(folder.path(), live)).trajectory.size(), 1);
  std::filesystem::remove(folder / "trajectory.txt");
  EXPECT_THAT(good(read_run(folder.path(), live)).remarks, Contains("no pose yet"));
}

TEST(BringTogether, MovesScoredRunsOntoTheTruth) {
  const RunFolder folder;
  folder.add_truth();
  std::vector<ViewedRun> runs{good(read_run(folder.path(), {}))};
  EXPECT_TRUE(bring_together(runs));
  const ViewedRun& run = runs[0];
  for (std::size_t i = 0; i < run.trajectory.size(); ++i)
    EXPECT_TRUE(
        run.trajectory[i].world_from_camera.translation().isApprox(run.truth[i].world_from_camera.translation(), 1e-6));
  EXPECT_TRUE(run.cloud.points[1].position_m.isApprox(Eigen::Vector3f(2, 2, 3), 1e-5f));
  EXPECT_TRUE(run.key_frames[0].world_from_camera.translation().isApprox(Eigen::Vector3d(2, 0, 0), 1e-6));
}

TEST(BringTogether, WhereOneHasNoTruthEachStaysInItsWorld) {
  const RunFolder scored, other;
  scored.add_truth();
  std::vector<ViewedRun> runs{good(read_run(scored.path(), {})), good(read_run(other.path(), {}))};
  EXPECT_FALSE(bring_together(runs));
  EXPECT_TRUE(runs[0].trajectory[0].world_from_camera.translation().isApprox(Eigen::Vector3d(1, 0, 0), 1e-6));
  EXPECT_TRUE(runs[0].truth[0].world_from_camera.translation().isApprox(Eigen::Vector3d(1, 0, 0), 1e-6));
}

}  // namespace
}  // namespace semvslam
