#include "semvslam/apps/run_statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace semvslam {
namespace {

RunRecord record() {
  RunRecord r;
  r.sequence = "bad \xff name";
  r.read = 100, r.skipped = 2, r.dropped = 3;
  r.wall_s = 4, r.cpu_s = 1.5;
  r.peak_memory_bytes = 123'000'000;
  r.end = "complete";
  return r;
}

SlamStatistics statistics() {
  SlamStatistics s;
  s.frames = 95, s.tracked = 90, s.lost = 4, s.key_frames = 12, s.landmarks = 345;
  s.stages.push_back({"tracking", 95, 5.5, 5, 9, 20});
  return s;
}

TEST(RunStatistics, JsonHoldsEveryNumber) {
  const auto json = nlohmann::json::parse(format_statistics(record(), statistics()));
  EXPECT_EQ(json["frames"], 100);
  EXPECT_EQ(json["tracked"], 90);
  EXPECT_DOUBLE_EQ(json["tracked_share"].get<double>(), 0.9);
  EXPECT_EQ(json["key_frames"], 12);
  EXPECT_DOUBLE_EQ(json["stages_ms"]["tracking"]["p95"].get<double>(), 9);
  EXPECT_DOUBLE_EQ(json["cpu_ms_per_frame"].get<double>(), 15);
  EXPECT_DOUBLE_EQ(json["frames_per_s"].get<double>(), 25);
  EXPECT_DOUBLE_EQ(json["peak_memory_mb"].get<double>(), 123);
}

TEST(RunStatistics, SubMapsApartAreNamedAndNotCountedToTheMainOne) {
  SlamStatistics s = statistics();
  s.sub_maps_begun = 2, s.sub_maps_joined = 1;
  s.sub_map = SubMapId(1);
  s.apart.push_back({SubMapId(0), 7, 3, 99});
  const auto json = nlohmann::json::parse(format_statistics(record(), s))["sub_maps"];
  EXPECT_EQ(json["begun"], 2);
  EXPECT_EQ(json["joined"], 1);
  EXPECT_EQ(json["main"], 2);
  ASSERT_EQ(json["apart"].size(), 1u);
  EXPECT_EQ(json["apart"][0]["number"], 1);
  EXPECT_EQ(json["apart"][0]["tracked"], 7);
  EXPECT_EQ(json["apart"][0]["key_frames"], 3);
  EXPECT_EQ(json["apart"][0]["landmarks"], 99);
  EXPECT_THAT(format_summary(record(), s), ::testing::HasSubstr("sub-map 1 was never joined with sub-map 2"));
  EXPECT_THAT(format_summary(record(), statistics()), ::testing::Not(::testing::HasSubstr("sub-map")));
}

TEST(RunStatistics, PixelsOfTrueMasksAreMediansOverFrames) {
  RunRecord r = record();
  r.truth.emplace();
  r.truth->pixel_recalls = {.9, .1, .8};
  const auto json = nlohmann::json::parse(format_statistics(r, statistics()));
  EXPECT_DOUBLE_EQ(json["truth"]["pixel_recall"].get<double>(), .8);
  EXPECT_TRUE(json["truth"]["pixel_precision"].is_null());
}

TEST(RunStatistics, ARunWithoutFramesHasNoDivisionByZero) {
  const auto json = nlohmann::json::parse(format_statistics(RunRecord{}, SlamStatistics{}));
  EXPECT_EQ(json["tracked_share"], 0.0);
  EXPECT_EQ(json["cpu_ms_per_frame"], 0.0);
}

TEST(RunStatistics, SummaryNamesWhatWentWrongOnlyWhereSomethingDid) {
  EXPECT_THAT(format_summary(record(), statistics()),
              ::testing::HasSubstr("100 frames, 90 tracked, 4 lost, 2 skipped as unusable (see run.log), 3 dropped"));
  RunRecord clean = record();
  clean.skipped = clean.dropped = 0;
  EXPECT_THAT(format_summary(clean, statistics()), ::testing::Not(::testing::HasSubstr("skipped")));
}

}  // namespace
}  // namespace semvslam
