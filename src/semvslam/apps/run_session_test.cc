#include "semvslam/apps/run_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "semvslam/base/temporary_folder_test_support.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;

/// A textured wall 2 m away and a camera that stands still; at chosen frames something else happens.
class WallSource final : public FrameSource {
 public:
  struct Plan {
    int frames = 12;
    int damaged_frame = -1;  // an Error that may pass
    int fatal_frame = -1;    // an Error that ends the stream
    int small_frame = -1;    // an image of another size
    bool dark = false;       // nothing to see at all
    bool masked = false;     // every frame comes with a mask
  };

  explicit WallSource(const Plan& plan) : plan_(plan) {
    camera_.width_px = 320, camera_.height_px = 240;
    camera_.fx_px = camera_.fy_px = 260, camera_.cx_px = 160, camera_.cy_px = 120;
    gray_ = cv::Mat::zeros(240, 320, CV_8UC1);
    cv::RNG random(3);
    if (!plan.dark)
      for (int y = 0; y < 240; y += 8)
        for (int x = 0; x < 320; x += 8) gray_(cv::Rect(x, y, 8, 8)) = cv::Scalar(random.uniform(0, 255));
    depth_ = cv::Mat(240, 320, CV_16UC1, cv::Scalar(10000));
  }

  Result<std::optional<RgbdFrame>> next() override {
    const int index = next_++;
    if (index == plan_.fatal_frame) {
      fatal_ = true;
      return Error{ErrorCode::kIo, "the disk went away"};
    }
    if (index == plan_.damaged_frame) return Error{ErrorCode::kInvalidInput, "a damaged image"};
    if (index >= plan_.frames) return std::optional<RgbdFrame>();
    RgbdFrame frame;
    frame.stamp = TimeStamp::from_seconds(index / 30.0);
    frame.gray = index == plan_.small_frame ? gray_(cv::Rect(0, 0, 100, 100)).clone() : gray_;
    frame.depth = depth_;
    if (plan_.masked) {
      frame.mask = cv::Mat::zeros(240, 320, CV_8UC1);
      frame.mask(cv::Rect(0, 0, 100, 240)).setTo(255);
    }
    return std::optional<RgbdFrame>(std::move(frame));
  }
  bool fatal() const override { return fatal_; }
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return static_cast<std::size_t>(plan_.frames); }
  std::string description() const override { return "a wall"; }

 private:
  const Plan plan_;
  Camera camera_;
  cv::Mat gray_, depth_;
  int next_ = 0;
  bool fatal_ = false;
};

class RunSessionTest : public ::testing::Test {
 protected:
  RunSessionTest() {
    options_.out = folder_ / "run";
    options_.quiet = true;
  }

  RunOutcome run(const WallSource::Plan& plan) {
    Config config;
    auto outcome = run_session(std::make_unique<WallSource>(plan), config, options_);
    EXPECT_TRUE(outcome) << outcome.error().message;
    return outcome ? *outcome : RunOutcome{};
  }
  std::string content(const std::string& name) const {
    std::ifstream file(options_.out / name);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  const testing_support::TemporaryFolder folder_;
  RunOptions options_;
};

TEST_F(RunSessionTest, TracksAllFrames) {
  const RunOutcome outcome = run({});
  EXPECT_TRUE(outcome.status);
  EXPECT_EQ(outcome.record.read, 12u);
  EXPECT_EQ(outcome.trajectory.size(), 12u);
  EXPECT_EQ(outcome.record.end, "complete");
  for (const StampedPose& pose : outcome.trajectory) EXPECT_LT(pose.world_from_camera.translation().norm(), 0.005);
}

TEST_F(RunSessionTest, UnusableFramesAreSkippedAndLogged) {
  const RunOutcome outcome =
      run({.frames = 12, .damaged_frame = 4, .fatal_frame = -1, .small_frame = 7, .dark = false});
  EXPECT_TRUE(outcome.status);
  EXPECT_EQ(outcome.record.skipped, 2u);
  EXPECT_EQ(outcome.trajectory.size(), 10u);
  EXPECT_THAT(content("run.log"), ::testing::HasSubstr("skipped: a damaged image"));
  EXPECT_THAT(content("run.log"), ::testing::HasSubstr("100x100"));
}

TEST_F(RunSessionTest, AFatalErrorOfTheSourceKeepsWhatWasComputed) {
  const RunOutcome outcome =
      run({.frames = 12, .damaged_frame = -1, .fatal_frame = 8, .small_frame = -1, .dark = false});
  ASSERT_FALSE(outcome.status);
  EXPECT_EQ(outcome.status.error().message, "the disk went away");
  EXPECT_EQ(outcome.trajectory.size(), 8u);
  EXPECT_THAT(content("stats.json"), ::testing::HasSubstr("\"end\": \"the disk went away\""));
  const std::string poses = content("trajectory.txt");
  EXPECT_EQ(std::count(poses.begin(), poses.end(), '\n'), 1 + 8);  // a comment line and the poses
}

TEST_F(RunSessionTest, StopsAtTheAskedNumberOfFrames) {
  options_.max_frames = 5;
  const RunOutcome outcome = run({});
  EXPECT_EQ(outcome.record.read, 5u);
  EXPECT_EQ(outcome.trajectory.size(), 5u);
}

TEST_F(RunSessionTest, TheMasksOfTheKeyFramesAreWrittenOnRequest) {
  options_.key_frame_masks = options_.out / "masks";
  WallSource::Plan plan;
  plan.masked = true;
  const RunOutcome outcome = run(plan);
  EXPECT_TRUE(outcome.status);
  const cv::Mat first = cv::imread((options_.key_frame_masks / "0.000000000.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(first.size(), cv::Size(320, 240));
  EXPECT_EQ(first.at<std::uint8_t>(120, 50), 255);
  EXPECT_EQ(first.at<std::uint8_t>(120, 200), 0);
  const auto files = std::distance(fs::directory_iterator(options_.key_frame_masks), fs::directory_iterator());
  EXPECT_EQ(static_cast<std::uint64_t>(files), outcome.statistics.key_frames);
}

TEST_F(RunSessionTest, TimeSpentBeforeIsNotTheRuns) {
  while (process_cpu_seconds() < 0.05) continue;
  options_.before = ProcessTime::now();
  const RunOutcome outcome = run({});
  EXPECT_GT(outcome.record.cpu_s, 0);
  EXPECT_LE(outcome.record.cpu_s, process_cpu_seconds() - options_.before.cpu_s);
  EXPECT_LE(outcome.record.start_up_s, process_age_seconds() - options_.before.age_s);
}

TEST_F(RunSessionTest, NothingTrackedIsAnError) {
  const RunOutcome outcome =
      run({.frames = 5, .damaged_frame = -1, .fatal_frame = -1, .small_frame = -1, .dark = true});
  ASSERT_FALSE(outcome.status);
  EXPECT_THAT(outcome.status.error().message, ::testing::HasSubstr("none of the 5 frames could be tracked"));
}

}  // namespace
}  // namespace semvslam
