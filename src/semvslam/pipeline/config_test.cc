#include "semvslam/pipeline/config.h"

#include <gtest/gtest.h>

#include "semvslam/pipeline/presets.h"

namespace semvslam {
namespace {

TEST(Config, EveryModeHasAPresetThatLoads) {
  ASSERT_EQ(mode_names().size(), 7u);
  for (const std::string& mode : mode_names()) {
    Config config;
    const Status status = config.apply_mode(mode);
    ASSERT_TRUE(status) << status.error().message;
    EXPECT_EQ(config.mode, mode);
    EXPECT_TRUE(config.check());
    EXPECT_EQ(config.needs_segmentation(), mode != "orb" && mode != "motion") << mode;
    EXPECT_EQ(config.dynamic.motion, mode == "motion" || mode == "masks+motion" || mode == "full") << mode;
    EXPECT_EQ(config.dynamic.restoration.mode == "carry", mode == "masks+repair" || mode == "full") << mode;
  }
}

TEST(Config, AModeSetsEverythingThatModesDifferIn) {
  Config from_full, fresh;
  ASSERT_TRUE(from_full.apply_mode("full"));
  ASSERT_TRUE(from_full.apply_mode("motion"));
  ASSERT_TRUE(fresh.apply_mode("motion"));
  EXPECT_EQ(from_full.dynamic.masks, fresh.dynamic.masks);
  EXPECT_EQ(from_full.segment.source, fresh.segment.source);
}

TEST(Config, AnUnknownModeIsNamedWithTheKnownOnes) {
  Config config;
  const Status status = config.apply_mode("fast");
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("'fast'"), std::string::npos);
  EXPECT_NE(status.error().message.find("masks+repair"), std::string::npos);
}

}  // namespace
}  // namespace semvslam
