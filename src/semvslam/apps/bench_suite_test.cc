#include "semvslam/apps/bench_suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/eval/published.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing_support::TemporaryFolder;

BenchSuite good(const std::string& text) {
  Result<BenchSuite> suite = parse_suite(text, "s.yaml", "s");
  EXPECT_TRUE(suite) << suite.error().message;
  return suite ? std::move(*suite) : BenchSuite();
}

std::string error_of(const std::string& text) {
  const Result<BenchSuite> suite = parse_suite(text, "s.yaml", "s");
  return suite ? "no error" : suite.error().message;
}

TEST(ParseSuite, ReadsEverything) {
  const BenchSuite suite = good(R"(name: mine
about: two kinds
modes: [orb, full]
runs: 3
rpe_delta: 10f
max_frames: 50
deterministic: true
truth_masks: false
limits: {mode: full, ate_rmse_m: 0.01, tracked_share: 0.9}
set:
  orb.features: 800
  dynamic: {rest_after_s: 5}
sequences:
  - kitchen_*
  - {path: office, name: desk, modes: full, limits: {ate_share_of_way: 0.02}}
  - {people: sitting, motion: rpy, frames: 30, size: 160x120, seed: 7, rate: 15, exact: true, blur: true}
)");
  EXPECT_EQ(suite.name, "mine");
  EXPECT_THAT(suite.modes, ElementsAre("orb", "full"));
  EXPECT_EQ(suite.baseline, "orb");
  EXPECT_EQ(suite.runs, 3);
  EXPECT_EQ(suite.rpe_delta.text(), "10f");
  EXPECT_EQ(suite.max_frames, 50u);
  EXPECT_TRUE(suite.deterministic);
  EXPECT_FALSE(suite.truth_masks);
  EXPECT_EQ(suite.limits.mode, "full");
  EXPECT_EQ(suite.limits.ate_rmse_m, 0.01);
  EXPECT_EQ(suite.limits.ate_share_of_way, std::nullopt);
  EXPECT_THAT(suite.assignments, ElementsAre("orb.features=800", "dynamic.rest_after_s=5"));
  ASSERT_EQ(suite.entries.size(), 3u);
  EXPECT_EQ(suite.entries[0].path, "kitchen_*");
  EXPECT_FALSE(suite.entries[0].limits);
  EXPECT_EQ(suite.entries[1].name, "desk");
  EXPECT_THAT(suite.entries[1].modes, ElementsAre("full"));
  EXPECT_EQ(suite.entries[1].limits->ate_share_of_way, 0.02);
  const SceneOptions& scene = *suite.entries[2].scene;
  EXPECT_EQ(scene.people + scene.motion, "sittingrpy");
  EXPECT_EQ(scene.frames, 30);
  EXPECT_EQ(scene.width_px, 160);
  EXPECT_EQ(scene.height_px, 120);
  EXPECT_EQ(scene.seed, 7u);
  EXPECT_EQ(scene.frame_rate_hz, 15);
  EXPECT_FALSE(scene.noise);
  EXPECT_TRUE(scene.motion_blur);
  EXPECT_EQ(suite.entries[2].name, "sitting_rpy_exact");
}

TEST(ParseSuite, HasDefaults) {
  const BenchSuite suite = good("sequences: here\n");
  EXPECT_EQ(suite.name, "s");
  EXPECT_THAT(suite.modes, ElementsAre("full"));
  EXPECT_EQ(suite.baseline, "") << "orb is not among the modes";
  EXPECT_EQ(suite.runs, 1);
  EXPECT_EQ(suite.entries[0].path, "here");
}

TEST(ParseSuite, AnUnknownKeyIsNamedWithTheNearest) {
  EXPECT_THAT(error_of("sequences: a\nrunz: 3\n"),
              HasSubstr("s.yaml:2: unknown key 'runz'; the nearest known one is 'runs'"));
  EXPECT_THAT(error_of("sequence: [{people: none}]\n"),
              HasSubstr("unknown key 'sequence'; the nearest known one is 'sequences'"));
  EXPECT_THAT(error_of("sequences:\n  - a\n  - {people: none, moton: xyz}\n"),
              HasSubstr("s.yaml:3: unknown key 'moton'; the nearest known one is 'motion'"));
  EXPECT_THAT(error_of("sequences: a\nlimits: {ate_rmse: 1}\n"),
              HasSubstr("the nearest known one is 'limits.ate_rmse_m'"));
  EXPECT_THAT(error_of("sequences: a\nset: {orb.featurs: 1}\n"),
              HasSubstr("s.yaml:2: set: unknown key 'orb.featurs'; the nearest known one is 'orb.features'"));
}

TEST(ParseSuite, ValuesAreChecked) {
  EXPECT_THAT(error_of("sequences: a\nruns: 0\n"), HasSubstr("s.yaml:2: runs must be in 1..1000, got 0"));
  EXPECT_THAT(error_of("sequences: a\nruns: [1, 2]\n"), HasSubstr("'runs.0'"));
  EXPECT_THAT(error_of("sequences: a\nmodes: [orb, fast]\n"), HasSubstr("s.yaml:2: unknown mode 'fast'"));
  EXPECT_THAT(error_of("sequences: [{path: a, modes: fast}]\n"), HasSubstr("unknown mode 'fast'"));
  EXPECT_THAT(error_of("sequences: a\nmodes: [orb, full, orb]\n"), HasSubstr("mode 'orb' is listed twice"));
  EXPECT_THAT(error_of("sequences: [{path: a, modes: 'orb,orb'}]\n"), HasSubstr("mode 'orb' is listed twice"));
  EXPECT_THAT(error_of("sequences: a\nbaseline: boxes\n"), HasSubstr("baseline 'boxes' is none of the modes"));
  EXPECT_THAT(error_of("sequences: a\nlimits: {mode: ful}\n"), HasSubstr("unknown mode 'ful'"));
  EXPECT_THAT(error_of("sequences: a\nlimits: {tracked_share: 1.5}\n"), HasSubstr("must be in 0..1"));
  EXPECT_THAT(error_of("sequences: a\nset: {orb.features: many}\n"), HasSubstr("orb.features must be an integer"));
  EXPECT_THAT(error_of("sequences: a\nset: {dense.max_depth_m: 0.2}\n"), HasSubstr("dense.min_depth_m"));
  EXPECT_THAT(error_of("sequences: a\nrpe_delta: 1h\n"), HasSubstr("rpe_delta"));
  EXPECT_THAT(error_of("sequences: a\nname: ../x\n"), HasSubstr("'../x' cannot be a suite's name"));
}

TEST(ParseSuite, EntriesAreFoldersOrScenes) {
  EXPECT_THAT(error_of("runs: 1\n"), HasSubstr("no 'sequences'"));
  EXPECT_THAT(error_of(""), HasSubstr("no 'sequences'"));
  EXPECT_THAT(error_of("sequences: []\n"), HasSubstr("has no value"));
  EXPECT_THAT(error_of("sequences:\n  - a\n  - {name: b}\n"), HasSubstr("s.yaml:3: a sequence needs either 'path' or"));
  EXPECT_THAT(error_of("sequences: [{path: a, frames: 3}]\n"), HasSubstr("'frames' is for rendered scenes"));
  EXPECT_THAT(error_of("sequences: [{path: a, people: none}]\n"), HasSubstr("either 'path' or"));
  EXPECT_THAT(error_of("sequences: [{people: flying}]\n"), HasSubstr("flying"));
  EXPECT_THAT(error_of("sequences: [{people: none, size: big}]\n"), HasSubstr("size is WIDTHxHEIGHT"));
  EXPECT_THAT(error_of("sequences: [{people: none, name: a/b}]\n"), HasSubstr("'a/b' cannot be a sequence's name"));
  EXPECT_THAT(error_of("sequences: [{people: none, camera: c.yaml}]\n"), HasSubstr("has a camera of its own"));
  EXPECT_THAT(error_of("sequences: [{path: a, camera: c.yaml, camera_preset: bonn}]\n"),
              HasSubstr("exclude each other"));
  EXPECT_THAT(error_of("sequences: [{path: a, camera_preset: kinect}]\n"), HasSubstr("no built-in camera 'kinect'"));
  EXPECT_THAT(error_of("sequences: {path: a}\n"), HasSubstr("'sequences' is a list"));
  EXPECT_THAT(error_of("sequences: {99999999999999999999: a}\n"), HasSubstr("'sequences' is a list"));
}

TEST(BuiltInSuites, AllLoad) {
  std::vector<std::string> names;
  for (const BuiltInSuite& built_in : built_in_suites()) {
    const auto suite = built_in.read();
    ASSERT_TRUE(suite) << suite.error().message;
    EXPECT_FALSE(suite->about.empty()) << suite->name;
    EXPECT_EQ(suite->baseline, "orb") << suite->name;
    names.push_back(suite->name);
    for (const SuiteEntry& entry : suite->entries)
      EXPECT_EQ(paper_sequence(entry.path).has_value(), suite->name == "tum") << entry.path;
  }
  EXPECT_THAT(names, ElementsAre("rendered", "modes", "accuracy", "tum"));
}

TEST(FindRecordings, ExpandsPatternsAndNamesWhatIsMissing) {
  const TemporaryFolder folder;
  for (const char* name : {"kitchen_a", "kitchen_b", "office"}) fs::create_directory(folder / name);
  const BenchSuite suite = good(
      "modes: [orb, full]\nlimits: {tracked_share: 0.5}\nsequences:\n  - kitchen_*\n  - cellar\n"
      "  - {path: office, name: kitchen_a, modes: full, limits: {ate_rmse_m: 1}}\n  - people: none\n");
  const FoundRecordings found = find_recordings(suite, folder.path());
  EXPECT_THAT(found.missing, ElementsAre((folder / "cellar").string()));
  ASSERT_EQ(found.recordings.size(), 4u);
  EXPECT_EQ(found.recordings[0].name, "kitchen_a");
  EXPECT_EQ(found.recordings[0].folder, folder / "kitchen_a");
  EXPECT_EQ(found.recordings[0].limits.tracked_share, 0.5);
  EXPECT_EQ(found.recordings[1].name, "kitchen_b");
  EXPECT_EQ(found.recordings[2].name, "kitchen_a_2") << "names are results' folders: each once";
  EXPECT_THAT(found.recordings[2].modes, ElementsAre("full"));
  EXPECT_EQ(found.recordings[2].limits.tracked_share, std::nullopt) << "an entry's limits are all that bind it";
  EXPECT_TRUE(found.recordings[3].scene);
  EXPECT_EQ(found.recordings[3].name, "none_halfsphere");
}

TEST(FindRecordings, ACameraFileIsLookedForBesideTheRecordings) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) fs::create_directory(folder / name);
  const BenchSuite suite = good("sequences: [{path: a, camera: c.yaml}, {path: b, camera_preset: bonn}]\n");
  const FoundRecordings found = find_recordings(suite, folder.path());
  ASSERT_EQ(found.recordings.size(), 2u);
  EXPECT_EQ(found.recordings[0].camera.file, (folder / "c.yaml").string());
  EXPECT_EQ(found.recordings[1].camera.file, "");
  EXPECT_EQ(found.recordings[1].camera.preset, "bonn");
}

TEST(FindRecordings, AFolderIsCalledByItsOwnName) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "walk");
  fs::create_directory_symlink(folder / "walk", folder / "rgbd_dataset_freiburg3_walking_xyz");
  const FoundRecordings found = find_recordings(
      suite_of_folders({(folder / "walk").string() + "/", folder / "rgbd_dataset_freiburg3_walking_xyz"}), {});
  ASSERT_EQ(found.recordings.size(), 2u);
  EXPECT_EQ(found.recordings[0].name, "walk");
  EXPECT_EQ(found.recordings[1].name, "fr3_walking_xyz");
}

TEST(PlainName, IsFitForAFolder) {
  EXPECT_TRUE(is_plain_name("kitchen walk"));
  for (const std::string& bad : {std::string(), std::string("."), std::string(".."), std::string("a/b"),
                                 std::string("a\nb"), std::string(101, 'a')})
    EXPECT_FALSE(is_plain_name(bad)) << bad;
}

}  // namespace
}  // namespace semvslam
