#include "semvslam/web/page.h"

#include <gmock/gmock.h>

#include "semvslam/web/page_assets.h"
#include "semvslam/web/run_folder_test_support.h"

namespace semvslam {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing_support::landmark_ply;
using testing_support::RunFolder;
using testing_support::write;

std::string page_of(const std::vector<std::filesystem::path>& folders) {
  Scene scene;
  for (const std::filesystem::path& folder : folders) {
    Result<ViewedRun> run = read_run(folder, {});
    EXPECT_TRUE(run);
    scene.runs.push_back(std::move(*run));
  }
  scene.in_truth_world = bring_together(scene.runs);
  return format_page(scene);
}

TEST(FormatPage, HoldsAllItNeedsAndAsksForNothing) {
  const RunFolder folder;
  const std::string page = page_of({folder.path()});
  EXPECT_THAT(page, StartsWith("<!doctype html>"));
  EXPECT_THAT(page, HasSubstr("<title>run - semvslam</title>"));
  EXPECT_THAT(page, HasSubstr("20 of 20 (100.0 %)"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, HasSubstr("connect-src 'none'"));
  for (const PageAsset& script : page_scripts()) EXPECT_THAT(page, HasSubstr(script.text));
  EXPECT_THAT(page, HasSubstr(page_style()));
  EXPECT_THAT(page, Not(HasSubstr("{{")));
}

TEST(FormatPage, EscapesWhatComesFromFiles) {
  const std::string evil = "<img src=x onerror=alert(1)>";
  const RunFolder folder(evil + "{{scene}}");
  write(folder / "stats.json",
        R"({"mode": "<script>alert(2)</script>", "notices": ["<b>"], "stages_ms": {"<i>": {}}})");
  const std::string page = page_of({folder.path()});
  for (const char* tag : {"<img", "<script>alert", "<b>", "<i>"}) EXPECT_THAT(page, Not(HasSubstr(tag)));
  EXPECT_THAT(page, HasSubstr("&lt;img src=x onerror=alert(1)&gt;{{scene}}"));
}

TEST(FormatPage, ComparesRuns) {
  const RunFolder first("first"), second("second");
  const std::string page = page_of({first.path(), second.path()});
  EXPECT_THAT(page, HasSubstr("Comparison"));
  EXPECT_THAT(page, HasSubstr("<summary>second</summary>"));
}

TEST(FormatPage, ARunWithoutAPoseIsAPageToo) {
  const RunFolder folder;
  write(folder / "trajectory.txt", "");
  EXPECT_THAT(page_of({folder.path()}), HasSubstr("not one frame was tracked"));
}

TEST(FormatPage, StaysSmallWhateverTheMap) {
  const RunFolder folder;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 700; ++i)
    for (int k = 0; k < 700; ++k) points.emplace_back(0.01f * static_cast<float>(i), 0.01f * static_cast<float>(k), 2);
  write(folder / "map.ply", landmark_ply(points));
  EXPECT_LT(page_of({folder.path()}).size(), 5'000'000);
}

}  // namespace
}  // namespace semvslam
