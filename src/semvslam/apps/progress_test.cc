#include "semvslam/apps/progress.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

TEST(FormatProgress, ShowsBarRateNoteAndTimeLeft) {
  EXPECT_EQ(format_progress({500, 1000, 10, "tracking"}),
            "[############------------] 500/1000  50.0 frames/s  tracking  10 s left");
}

TEST(FormatProgress, LongTimesInMinutesAndHours) {
  EXPECT_EQ(format_progress({1, 101, 1, ""}), "[------------------------] 1/101  1.0 frames/s  1:40 min left");
  EXPECT_EQ(format_progress({1, 7201, 1, ""}), "[------------------------] 1/7201  1.0 frames/s  2:00 h left");
}

TEST(FormatProgress, AtTheEndsOfTheRange) {
  EXPECT_EQ(format_progress({0, 10, 0, "initializing"}), "[------------------------] 0/10  0.0 frames/s  initializing");
  EXPECT_EQ(format_progress({10, 10, 2, ""}), "[########################] 10/10  5.0 frames/s");
  EXPECT_EQ(format_progress({12, 10, 2, ""}), "[########################] 12/10  6.0 frames/s");
}

TEST(FormatProgress, WithoutATotalThereIsNoBar) {
  EXPECT_EQ(format_progress({7, std::nullopt, 2, "lost"}), "7 frames  3.5 frames/s  lost");
  EXPECT_EQ(format_progress({0, 0, 0, ""}), "0 frames  0.0 frames/s");
}

}  // namespace
}  // namespace semvslam
