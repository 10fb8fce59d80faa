#include "semvslam/web/live_feed.h"

#include <gmock/gmock.h>

#include <fstream>
#include <thread>

#include "semvslam/web/run_folder_test_support.h"

namespace semvslam {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing_support::RunFolder;
using testing_support::write;

void append_pose(const RunFolder& folder) {
  std::ofstream(folder / "trajectory.txt", std::ios::app) << "99 1 2 3 0 0 0 1\n";
}

/// A reader that has been told the numbers once, as every page is at its beginning.
LiveFeed::Reader reader_of(LiveFeed& feed) {
  LiveFeed::Reader reader{feed.cursor()};
  EXPECT_THAT(feed.wait_for_news(reader).value(), HasSubstr("event: numbers\n"));
  return reader;
}

TEST(LiveFeed, SendsPosesThatWereAppended) {
  const RunFolder folder;
  LiveFeed feed(folder.path());
  EXPECT_EQ(feed.cursor(), (LiveCursor{1, RunFolder::kPoses}));
  LiveFeed::Reader reader = reader_of(feed);
  append_pose(folder);
  feed.file_changed("trajectory.txt");
  EXPECT_EQ(feed.wait_for_news(reader), "event: poses\nid: 1:21\ndata: [[98.000000,1,2,3,0,0,0,1]]\n\n");
  EXPECT_EQ(reader.at, feed.cursor());
}

TEST(LiveFeed, WakesAReaderThatWaits) {
  const RunFolder folder;
  LiveFeed feed(folder.path());
  LiveFeed::Reader reader = reader_of(feed);
  std::optional<std::string> news;
  std::thread waiting([&] { news = feed.wait_for_news(reader); });
  append_pose(folder);
  feed.file_changed("trajectory.txt");
  waiting.join();
  EXPECT_THAT(news.value(), HasSubstr("event: poses"));
}

TEST(LiveFeed, TellsThatNumbersChanged) {
  const RunFolder folder;
  write(folder / "stats.json", R"({"end": "running"})");
  LiveFeed feed(folder.path());
  LiveFeed::Reader reader = reader_of(feed);
  write(folder / "stats.json", R"({"end": "running", "frames": 3})");
  feed.file_changed("stats.json");
  EXPECT_EQ(feed.wait_for_news(reader), "event: numbers\nid: 1:20\ndata: \n\n");
}

TEST(LiveFeed, AnotherTrajectoryAMapAndTheEndAreAnotherScene) {
  const RunFolder folder;
  write(folder / "stats.json", R"({"end": "running"})");
  LiveFeed feed(folder.path());
  LiveFeed::Reader reader = reader_of(feed);
  const auto expect_scene_after = [&](const char* file) {
    feed.file_changed(file);
    EXPECT_THAT(feed.wait_for_news(reader).value(), HasSubstr("event: scene")) << file;
  };
  ASSERT_TRUE(write_trajectory(folder / "trajectory.txt", testing_support::quarter_circle(3)));
  expect_scene_after("trajectory.txt");
  expect_scene_after("map.ply");
  write(folder / "stats.json", R"({"end": "complete"})");
  expect_scene_after("stats.json");
  expect_scene_after("");
}

TEST(LiveFeed, OtherFilesAreNoNews) {
  const RunFolder folder;
  LiveFeed feed(folder.path());
  const LiveCursor before = feed.cursor();
  feed.file_changed("run.log");
  EXPECT_EQ(feed.cursor(), before);
}

TEST(LiveFeed, AReaderOfAnotherTimeIsToldToReadEverything) {
  const RunFolder folder;
  LiveFeed feed(folder.path());
  for (const LiveCursor foreign : {LiveCursor{7, 0}, LiveCursor{1, 1000}}) {
    LiveFeed::Reader reader{foreign};
    EXPECT_THAT(feed.wait_for_news(reader).value(), HasSubstr("event: scene\nid: 1:20\n"));
  }
}

TEST(LiveFeed, EndsForAll) {
  const RunFolder folder;
  LiveFeed feed(folder.path());
  LiveFeed::Reader reader = reader_of(feed);
  std::thread waiting([&] { EXPECT_EQ(feed.wait_for_news(reader), std::nullopt); });
  feed.stop();
  waiting.join();
}

}  // namespace
}  // namespace semvslam
