// The facade with masks: where they come from, what happens when they do not come.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/pipeline/slam.h"
#include "semvslam/tracking/plane_world_testing.h"

namespace semvslam {
namespace {

using testing::PlaneWorld;

class NoticeCollector final : public Sink {
 public:
  void on_frame(const RgbdFrame&, const TrackResult& result) override { last = result.dynamic; }
  void on_notice(const std::string& line) override { lines.push_back(line); }
  std::vector<std::string> lines;
  std::shared_ptr<const DynamicRecord> last;
};

class DynamicSlamTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // The threads under test are ours. The thread sanitizer does not see how OpenCV's hand memory back.
    cv::setNumThreads(1);
    for (int i = 0; i < kFrames; ++i) {
      cv::Mat mask = cv::Mat::zeros(240, 320, CV_8UC1);
      mask(cv::Rect(60 + i, 60, 60, 120)).setTo(1);
      cv::imwrite(file(i).string(), mask);
    }
    config.deterministic = true;
    EXPECT_TRUE(config.apply_mode("masks"));
    config.segment.source = "folder";
    config.segment.mask_folder = folder.path().string();
  }

  std::filesystem::path file(int frame) const {
    char name[32];
    std::snprintf(name, sizeof name, "%.6f.png", world.render(frame).stamp.seconds());
    return folder / name;
  }
  /// Tracks all frames; every one must be tracked.
  void run() {
    Result<std::unique_ptr<Slam>> made = Slam::create(config, world.camera());
    ASSERT_TRUE(made) << made.error().message;
    slam = std::move(*made);
    slam->add_sink(notices);
    for (int i = 0; i < kFrames; ++i) {
      const Result<TrackResult> result = slam->process(world.render(i));
      ASSERT_TRUE(result) << result.error().message;
      EXPECT_EQ(result->state, TrackingState::kTracking) << "frame " << i;
      sources.push_back(result->mask_source);
    }
    ASSERT_TRUE(slam->finish());
  }

  static constexpr int kFrames = 12;
  PlaneWorld world;
  const testing_support::TemporaryFolder folder;
  Config config;
  std::unique_ptr<Slam> slam;
  std::shared_ptr<NoticeCollector> notices = std::make_shared<NoticeCollector>();
  std::vector<MaskSource> sources;
};

TEST_F(DynamicSlamTest, EveryFrameIsTrackedWithItsOwnMask) {
  run();
  EXPECT_EQ(std::count(sources.begin(), sources.end(), MaskSource::kSegmented), kFrames);
  const cv::Rect person(60 + kFrames - 1, 60, 60, 120);
  ASSERT_NE(notices->last, nullptr);
  ASSERT_GT(notices->last->features.size(), 100u);
  const int rim_px = config.dynamic.dilate_px;
  const cv::Rect inside(person.tl() + cv::Point(rim_px, rim_px), person.size() - cv::Size(2 * rim_px, 2 * rim_px));
  int at_outline = 0;
  for (const FeatureMark& mark : notices->last->features) {
    EXPECT_FALSE(inside.contains(mark.pixel));
    if (!person.contains(mark.pixel)) continue;
    ++at_outline;
    EXPECT_NE(mark.use, kFullyUsed);
  }
  EXPECT_GT(at_outline, 0) << "known landmarks are looked for there";
  EXPECT_EQ(slam->statistics().dynamic.mask_sources[static_cast<std::size_t>(MaskSource::kSegmented)],
            static_cast<std::uint64_t>(kFrames));
  EXPECT_TRUE(notices->lines.empty());
  const std::vector<KeyFrameMask> masks = slam->key_frame_masks();
  ASSERT_EQ(masks.size(), slam->key_frame_trajectory().size());
  for (const KeyFrameMask& mask : masks) {
    const float x_px = 60.f + static_cast<float>(mask.frame.value) + 30.f;
    EXPECT_TRUE(mask.moving.contains({x_px, 120.f})) << "the key frame keeps its mask";
    EXPECT_FALSE(mask.moving.contains({x_px + 60.f, 120.f}));
    ASSERT_TRUE(mask.classes);
    ASSERT_EQ(mask.classes->size(), 1u);
    EXPECT_EQ(mask.classes->front().class_name, "person");
    EXPECT_TRUE(mask.classes->front().pixels.contains({x_px, 120.f}));
    EXPECT_FALSE(mask.classes->front().pixels.contains({x_px + 60.f, 120.f}));
  }
}

TEST_F(DynamicSlamTest, ASegmenterThatFailsInMidRunIsReplacedByMotionAndSaidOnce) {
  std::ofstream(file(5), std::ios::trunc) << "no PNG";
  run();
  ASSERT_EQ(notices->lines.size(), 1u);
  EXPECT_NE(notices->lines[0].find("motion"), std::string::npos) << notices->lines[0];
  EXPECT_EQ(slam->statistics().notices, notices->lines);
  EXPECT_EQ(sources[4], MaskSource::kSegmented);
  EXPECT_EQ(sources[8], MaskSource::kNone);
  const DynamicTotals totals = slam->statistics().dynamic;
  EXPECT_GT(totals.track_reasons[static_cast<std::size_t>(MotionReason::kNone)], 0u) << "motion found points at rest";
}

TEST_F(DynamicSlamTest, AMissingNetworkIsReplacedByMotionFromTheStart) {
  config.segment.source = "network";
  config.segment.model = (folder / "nowhere").string();
  run();
  ASSERT_EQ(notices->lines.size(), 1u);
  EXPECT_NE(notices->lines[0].find("nowhere"), std::string::npos) << notices->lines[0];
  EXPECT_TRUE(slam->effective_config().dynamic.motion);
}

TEST_F(DynamicSlamTest, MasksOfAnotherSizeAreAFailureOfTheSegmenter) {
  for (int i = 0; i < kFrames; ++i) cv::imwrite(file(i).string(), cv::Mat::zeros(48, 64, CV_8UC1));
  run();
  EXPECT_EQ(notices->lines.size(), 1u);
}

TEST_F(DynamicSlamTest, RealtimeNeverWaitsAndStillUsesMasks) {
  config.deterministic = false;
  config.realtime = true;
  EXPECT_TRUE(config.apply_mode("full"));
  config.segment.source = "folder";
  config.segment.mask_folder = folder.path().string();
  run();
  EXPECT_TRUE(notices->lines.empty());
}

}  // namespace
}  // namespace semvslam
