#include "semvslam/apps/bench_runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/trajectory_io.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing_support::TemporaryFolder;

constexpr const char* kStatistics = R"({"end": "complete", "frames": 60, "tracked": 59, "lost": 1, "skipped": 0,
  "stages_ms": {"tracking": {"mean": 5.5, "p95": 8.5}}, "frames_per_s": 50, "cpu_ms_per_frame": 12,
  "peak_memory_mb": 90, "start_up_s": 0.1, "wall_s": 1.2, "truth": {"frames": 60, "kept_on_moving": 0.1,
  "tracked_on_moving": 0.2, "static_dropped": 0.3, "clear_static_dropped": 0.4, "static_barred": 0.5}})";

std::string statistics_with(const std::string& from, const std::string& to) {
  std::string text = kStatistics;
  text.replace(text.find(from), from.size(), to);
  return text;
}

/// A bench of one run whose program is a shell script instead of ours. The script is called with our arguments and
/// counts its calls in `calls`; $out is the folder for its results.
class BenchRunnerTest : public ::testing::Test {
 protected:
  BenchRunnerTest() {
    fs::create_directories(recording());
    write_lists("0.1 rgb/a.png\n");
    Trajectory truth;
    for (int i = 0; i < 60; ++i)
      truth.push_back({TimeStamp{i * std::int64_t{50'000'000}},
                       SE3(Eigen::Quaterniond::Identity(), {0.01 * i, 0.0001 * i * i, 0})});
    EXPECT_TRUE(write_trajectory(recording() / "groundtruth.txt", truth));
    EXPECT_TRUE(write_file_atomically(folder_ / "stats.json", kStatistics));
  }

  fs::path recording() const { return folder_ / "walk"; }
  void write_lists(const std::string& text) const { EXPECT_TRUE(write_file_atomically(recording() / "rgb.txt", text)); }
  /// What a run that ends well writes.
  std::string good_script() const {
    return "cp " + (folder_ / "stats.json").string() + " \"$out\"; grep -v '^#' " +
           (recording() / "groundtruth.txt").string() + " > \"$out/trajectory.txt\"; echo x > \"$out/map.ply\"";
  }
  void write_script(const std::string& body) const {
    const fs::path path = folder_ / "program";
    std::ofstream(path) << "#!/bin/sh\necho \"$@\" >> " << (folder_ / "calls").string()
                        << "\nfor out in \"$@\"; do :; done\n"
                        << body << "\n";
    fs::permissions(path, fs::perms::owner_all);
  }
  BenchRunner runner(bool again = false, const std::string& identity = "semvslam 1") const {
    return {{(folder_ / "program").string(), identity}, folder_ / "bench", again, {}};
  }
  PlannedRun plan() const {
    BenchSuite suite = suite_of_folders({recording().string()});
    suite.modes = {"orb"};
    return plan_runs(suite, find_recordings(suite, {}).recordings).at(0);
  }
  BenchRunner::Outcome perform(const BenchRunner& with) const { return perform(with, plan()); }
  BenchRunner::Outcome perform(BenchRunner with, const PlannedRun& plan) const {
    Result<BenchRunner::Outcome> outcome = with.perform(plan, recording(), read_truth(recording()));
    EXPECT_TRUE(outcome) << outcome.error().message;
    return outcome ? std::move(*outcome) : BenchRunner::Outcome{};
  }
  int calls() const {
    const auto text = read_text_file(folder_ / "calls");
    return text ? static_cast<int>(std::count(text->begin(), text->end(), '\n')) : 0;
  }

  const TemporaryFolder folder_;
};

TEST_F(BenchRunnerTest, ReadsTheNumbersAndScoresTheTrajectory) {
  write_script(good_script());
  const BenchRunner::Outcome outcome = perform(runner());
  EXPECT_EQ(outcome.run.failure, "");
  EXPECT_FALSE(outcome.kept);
  EXPECT_EQ(outcome.run.frames, 60u);
  EXPECT_EQ(outcome.run.tracking_p95_ms, 8.5);
  ASSERT_TRUE(outcome.run.truth);
  EXPECT_EQ(outcome.run.truth->static_barred, 0.5);
  ASSERT_TRUE(outcome.run.score) << outcome.no_score;
  EXPECT_LT(outcome.run.score->ate_m.rmse, 1e-6);
  EXPECT_NEAR(outcome.run.way_m, 0.707, 0.001);
  EXPECT_TRUE(fs::exists(folder_ / "bench/runs/walk/orb/1/stats.json"));
  EXPECT_FALSE(fs::exists(folder_ / "bench/runs/walk/orb/1/map.ply")) << "too large to be kept for nobody";
}

TEST_F(BenchRunnerTest, ACompleteRunIsKept) {
  write_script(good_script());
  const BenchRunner::Outcome first = perform(runner()), second = perform(runner());
  EXPECT_EQ(calls(), 1);
  EXPECT_TRUE(second.kept);
  EXPECT_EQ(second.run.score->ate_m.rmse, first.run.score->ate_m.rmse);
  EXPECT_EQ(second.run.frames_per_s, first.run.frames_per_s);
}

TEST_F(BenchRunnerTest, WhatChangesResultsMakesItRunAgain) {
  write_script(good_script());
  perform(runner());
  perform(runner(true));
  EXPECT_EQ(calls(), 2) << "asked for";
  perform(runner(false, "semvslam 2"));
  EXPECT_EQ(calls(), 3) << "another program";
  PlannedRun other = plan();
  other.arguments.insert(other.arguments.end(), {"--set", "orb.features=500"});
  perform(runner(false, "semvslam 2"), other);
  EXPECT_EQ(calls(), 4) << "another configuration";
  write_lists("0.2 rgb/b.png\n");
  perform(runner(false, "semvslam 2"), other);
  EXPECT_EQ(calls(), 5) << "another recording under the same name";
  other.camera_file = (folder_ / "camera.yaml").string();
  EXPECT_TRUE(write_file_atomically(other.camera_file, "fx: 500\n"));
  perform(runner(false, "semvslam 2"), other);
  EXPECT_TRUE(write_file_atomically(other.camera_file, "fx: 501\n"));
  perform(runner(false, "semvslam 2"), other);
  EXPECT_EQ(calls(), 7) << "another camera";
  fs::remove(folder_ / "bench/runs/walk/orb/1/stats.json");
  EXPECT_FALSE(perform(runner(false, "semvslam 2"), other).kept);
  EXPECT_EQ(calls(), 8) << "its results are gone";
  EXPECT_TRUE(perform(runner(false, "semvslam 2"), other).kept);
}

TEST_F(BenchRunnerTest, AnotherCameraIsHandedOn) {
  BenchSuite suite = suite_of_folders({recording().string()});
  suite.entries[0].camera.file = "c.yaml";
  const std::vector<PlannedRun> plans = plan_runs(suite, find_recordings(suite, folder_.path()).recordings);
  const std::string file = (folder_ / "c.yaml").string();
  EXPECT_THAT(plans.at(0).arguments, ::testing::IsSupersetOf({std::string("--camera"), file}));
  EXPECT_EQ(plans.at(0).camera_file, file);
}

TEST_F(BenchRunnerTest, AFailureIsToldWithTheProgramsOwnWordsAndTriedAgain) {
  write_script("echo 'semvslam: error: none of the 60 frames could be tracked' >&2; exit 3");
  EXPECT_EQ(perform(runner()).run.failure, "exit code 3: none of the 60 frames could be tracked");
  write_script("kill -KILL $$");
  EXPECT_THAT(perform(runner()).run.failure, HasSubstr("killed by signal 9"));
  EXPECT_EQ(calls(), 2);
  fs::remove(folder_ / "program");
  EXPECT_THAT(perform(runner()).run.failure, HasSubstr("cannot be started"));
}

TEST_F(BenchRunnerTest, ASuccessWithoutResultsIsAFailure) {
  write_script("exit 0");
  EXPECT_THAT(perform(runner()).run.failure, HasSubstr("stats.json"));
  write_script("echo '{}' > \"$out/stats.json\"");
  EXPECT_THAT(perform(runner()).run.failure, HasSubstr("stats.json is not what 'semvslam run' writes"));
  EXPECT_FALSE(perform(runner()).kept);
}

TEST_F(BenchRunnerTest, ATrajectoryThatCannotBeScoredSaysWhy) {
  write_script(good_script() + "; echo '900 0 0 0 0 0 0 1' > \"$out/trajectory.txt\"");
  const BenchRunner::Outcome outcome = perform(runner());
  EXPECT_EQ(outcome.run.failure, "");
  EXPECT_FALSE(outcome.run.score);
  EXPECT_THAT(outcome.no_score, HasSubstr("3 are needed"));
}

TEST_F(BenchRunnerTest, AFolderThatCannotBeMadeEndsTheBench) {
  write_script(good_script());
  std::ofstream(folder_ / "bench") << "a file";
  BenchRunner blocked = runner();
  EXPECT_FALSE(blocked.perform(plan(), recording(), {}));
}

TEST(PlanRuns, ModesTakeTurns) {
  BenchSuite suite;
  suite.runs = 2;
  const std::vector<BenchRecording> recordings = {{"a", "/x/a", {}, {"orb", "full"}, {}, {}},
                                                  {"b", "/x/b", {}, {"full"}, {}, {}}};
  std::vector<std::string> folders;
  for (const PlannedRun& plan : plan_runs(suite, recordings)) folders.push_back(plan.folder);
  EXPECT_THAT(folders, ElementsAre("runs/a/orb/1", "runs/a/full/1", "runs/a/orb/2", "runs/a/full/2", "runs/b/full/1",
                                   "runs/b/full/2"));
}

TEST(PlanRuns, ArgumentsFollowTheSuite) {
  const TemporaryFolder folder;
  BenchSuite suite;
  const auto arguments = [&] { return plan_runs(suite, {{"a", folder.path(), {}, {"orb"}, {}, {}}}).at(0).arguments; };
  const std::string path = folder.path().string();
  EXPECT_THAT(arguments(), ElementsAre("run", path, "--mode", "orb", "--quiet"));
  fs::create_directory(folder / "mask");
  EXPECT_EQ(arguments().size(), 5u) << "a folder without masks";
  std::ofstream(folder / "mask/1.png") << "x";
  EXPECT_THAT(arguments(), ElementsAre("run", path, "--mode", "orb", "--quiet", "--truth-masks", "mask"));
  suite.truth_masks = false;
  suite.deterministic = true;
  suite.max_frames = 9;
  suite.assignments = {"orb.features=500"};
  EXPECT_THAT(arguments(), ElementsAre("run", path, "--mode", "orb", "--quiet", "--deterministic", "--max-frames", "9",
                                       "--set", "orb.features=500"));
}

TEST(ReadStatistics, RefusesWhatIsNotTheEndOfARun) {
  BenchRun run;
  EXPECT_TRUE(read_statistics(kStatistics, run));
  for (const std::string& bad :
       {std::string("not JSON"), std::string("[]"), std::string("{}"), statistics_with("\"complete\"", "\"running\""),
        statistics_with("\"frames\": 60", "\"frames\": \"many\""), statistics_with("{\"mean\": 5.5", "{\"meen\": 5.5")})
    EXPECT_THAT(read_statistics(bad, run).error().message, HasSubstr("stats.json"));
}

TEST(ReadStatistics, WithoutCountedTruthThereAreNoShares) {
  BenchRun run;
  ASSERT_TRUE(read_statistics(statistics_with("\"truth\": {\"frames\": 60", "\"truth\": {\"frames\": 0"), run));
  EXPECT_FALSE(run.truth);
}

TEST(ReadTruth, OfAFolderWithoutOneIsNothing) {
  const TemporaryFolder folder;
  const BenchTruth none = read_truth(folder.path());
  EXPECT_FALSE(none.poses);
  EXPECT_EQ(none.trouble, "");
  std::ofstream(folder / "groundtruth.txt") << "1 2 3\n";
  EXPECT_THAT(read_truth(folder.path()).trouble, HasSubstr("groundtruth.txt:1"));
}

TEST(BenchProgramSelf, HasTheSameIdentityEveryTime) {
  const auto first = BenchProgram::self(), second = BenchProgram::self();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->identity, second->identity);
  EXPECT_THAT(first->identity, HasSubstr("semvslam "));
}

}  // namespace
}  // namespace semvslam
