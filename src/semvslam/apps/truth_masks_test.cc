#include "semvslam/apps/truth_masks.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "semvslam/base/temporary_folder_test_support.h"

namespace semvslam {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;
namespace fs = std::filesystem;

constexpr int kOutlinePx = 4;
const cv::Size kSize(320, 240);

/// A folder with one true mask, of the frame at 1 s: the rectangle moves.
class TruthMasks : public testing::Test {
 protected:
  void SetUp() override { cv::imwrite((folder_ / "1.000000.png").string(), filled(moving_)); }

  static cv::Mat filled(const cv::Rect& rect) {
    cv::Mat mask = cv::Mat::zeros(kSize, CV_8UC1);
    mask(rect).setTo(255);
    return mask;
  }

  /// What is counted when the policy masks the rectangle (its outline moved outwards, as it does) and marks the
  /// features.
  TruthCounts counts_of(const cv::Rect& masked, std::vector<FeatureMark> features) const {
    auto sink = TruthMaskSink::open(folder_.path(), OrbOptions{}, kOutlinePx);
    if (!sink) throw std::runtime_error(sink.error().message);
    auto record = std::make_shared<DynamicRecord>();
    if (!masked.empty()) {
      record->moving = filled(masked + cv::Size(2 * kOutlinePx, 2 * kOutlinePx) - cv::Point(kOutlinePx, kOutlinePx));
      record->left_out = {filled(masked)};
    }
    record->features = std::move(features);
    RgbdFrame frame;
    frame.stamp = TimeStamp{1'000'000'000};
    frame.gray = cv::Mat(kSize, CV_8UC1, cv::Scalar(90));  // no features of its own
    TrackResult result;
    result.dynamic = record;
    (*sink)->on_frame(frame, result);
    return (*sink)->counts();
  }

  const testing_support::TemporaryFolder folder_;
  cv::Rect moving_{100, 60, 80, 100};
};

TEST_F(TruthMasks, PixelsAreComparedAtTheOutlineThatThePolicyFound) {
  const TruthCounts exact = counts_of(moving_, {});
  EXPECT_EQ(exact.frames, 1u);
  EXPECT_THAT(exact.pixel_recalls, ElementsAre(DoubleEq(1)));
  EXPECT_THAT(exact.pixel_precisions, ElementsAre(DoubleEq(1)));
  const TruthCounts half = counts_of({140, 60, 80, 100}, {});
  EXPECT_THAT(half.pixel_recalls, ElementsAre(DoubleEq(.5)));
  EXPECT_THAT(half.pixel_precisions, ElementsAre(DoubleEq(.5)));
  const TruthCounts nothing = counts_of({}, {});
  EXPECT_THAT(nothing.pixel_recalls, ElementsAre(DoubleEq(0)));
  EXPECT_TRUE(nothing.pixel_precisions.empty());
}

TEST_F(TruthMasks, FeaturesAreCountedByWhatTheyMayBeUsedFor) {
  const auto mark = [](float x, FeatureUse use, bool tracked) {
    FeatureMark m;
    m.pixel = {x, 100};
    m.use = use;
    m.tracked = tracked;
    return m;
  };
  const TruthCounts counts = counts_of(
      {}, {mark(120, kFullyUsed, true), mark(130, kNotUsed, false), mark(140, kKnownLandmarkOnly, false),
           mark(20, kFullyUsed, true), mark(30, kKnownLandmarkOnly, true), mark(40, kKnownLandmarkOnly, false)});
  EXPECT_DOUBLE_EQ(counts.kept_on_moving.value(), 1. / 3);     // 120, 20 and 30 are kept
  EXPECT_DOUBLE_EQ(counts.tracked_on_moving.value(), 1. / 3);  // and found
  EXPECT_DOUBLE_EQ(counts.static_barred.value(), 1. / 3);      // 40 of 20, 30 and 40
}

TEST_F(TruthMasks, AFrameWithoutATrueMaskIsNotCounted) {
  fs::rename(folder_ / "1.000000.png", folder_ / "7.000000.png");
  EXPECT_EQ(counts_of(moving_, {}).frames, 0u);
}

TEST_F(TruthMasks, AFolderWithoutMasksIsAnError) {
  EXPECT_FALSE(TruthMaskSink::open(folder_ / "absent", OrbOptions{}, kOutlinePx));
}

}  // namespace
}  // namespace semvslam
