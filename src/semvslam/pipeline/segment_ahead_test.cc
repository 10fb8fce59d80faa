#include "semvslam/pipeline/segment_ahead.h"

#include <gtest/gtest.h>

#include <atomic>

namespace semvslam {
namespace {

/// Gives frames 0, 1, ... `count` - 1; every third is an Error; optionally ends with a fatal one.
class CountingSource final : public FrameSource {
 public:
  CountingSource(std::uint32_t count, bool fails) : count_(count), fails_(fails) {}
  Result<std::optional<RgbdFrame>> next() override {
    if (next_ == count_) {
      if (!fails_) return std::optional<RgbdFrame>();
      fatal_ = true;
      return Error{ErrorCode::kIo, "the disk is gone"};
    }
    RgbdFrame frame;
    frame.id = FrameId(next_++);
    if (frame.id.value % 3 == 2) return Error{ErrorCode::kInvalidInput, "damaged"};
    return std::optional<RgbdFrame>(frame);
  }
  bool fatal() const override { return fatal_; }
  const Camera& camera() const override { return camera_; }
  std::string description() const override { return "counting"; }

 private:
  const std::uint32_t count_;
  const bool fails_;
  std::uint32_t next_ = 0;
  bool fatal_ = false;
  Camera camera_;
};

std::optional<Segmentation> segment(const RgbdFrame& frame) {
  if (frame.id.value == 4) return std::nullopt;
  Segmentation segmentation;
  segmentation.frame = frame.id;
  return segmentation;
}

TEST(SegmentAhead, EveryFrameComesWithItsOwnSegmentationInOrder) {
  for (const std::size_t at_once : {1u, 2u, 5u}) {
    CountingSource source(30, false);
    SegmentAhead ahead(source, segment, at_once, 2);
    for (std::uint32_t i = 0; i < 30; ++i) {
      const auto next = ahead.next();
      if (i % 3 == 2) {
        ASSERT_FALSE(next);
        EXPECT_FALSE(ahead.fatal());
        continue;
      }
      ASSERT_TRUE(next);
      ASSERT_TRUE(*next);
      EXPECT_EQ((*next)->frame.id.value, i);
      EXPECT_TRUE((*next)->has_segmentation);
      ASSERT_EQ((*next)->segmentation.has_value(), i != 4);
      if (i != 4) {
        EXPECT_EQ((*next)->segmentation->frame.value, i);
      }
    }
    for (int again = 0; again < 2; ++again) {
      const auto end = ahead.next();
      ASSERT_TRUE(end);
      EXPECT_FALSE(*end);
    }
  }
}

TEST(SegmentAhead, WithoutASegmenterFramesPassThrough) {
  CountingSource source(2, false);
  SegmentAhead ahead(source, {}, 1, 2);
  const auto next = ahead.next();
  ASSERT_TRUE(next && *next);
  EXPECT_FALSE((*next)->has_segmentation);
}

TEST(SegmentAhead, AFatalErrorIsTheLastThingThatComes) {
  CountingSource source(1, true);
  SegmentAhead ahead(source, segment, 2, 2);
  ASSERT_TRUE(ahead.next());
  const auto failed = ahead.next();
  ASSERT_FALSE(failed);
  EXPECT_TRUE(ahead.fatal());
  EXPECT_EQ(failed.error().message, "the disk is gone");
}

TEST(SegmentAhead, DestructionDoesNotWaitForTheEndOfTheStream) {
  for (const std::size_t at_once : {1u, 3u}) {
    CountingSource source(1'000'000, false);
    std::atomic<std::size_t> segmented = 0;
    {
      SegmentAhead ahead(
          source,
          [&](const RgbdFrame& frame) {
            ++segmented;
            return segment(frame);
          },
          at_once, 3);
      ASSERT_TRUE(ahead.next());
    }
    EXPECT_LE(segmented, 1 + 3 + 2 * at_once) << "fetched, waiting and in work, and none after";
  }
}

TEST(SegmentAhead, SlowFramesDoNotHoldUpTheOthersAndKeepTheirPlace) {
  CountingSource source(6, false);
  std::promise<void> later_is_done;
  std::shared_future<void> done = later_is_done.get_future().share();
  SegmentAhead ahead(
      source,
      [&](const RgbdFrame& frame) {
        if (frame.id.value == 0) done.wait();
        if (frame.id.value == 1) later_is_done.set_value();
        return segment(frame);
      },
      2, 2);
  for (std::uint32_t i = 0; i < 2; ++i) {
    const auto next = ahead.next();
    ASSERT_TRUE(next && *next);
    EXPECT_EQ((*next)->frame.id.value, i);
  }
}

}  // namespace
}  // namespace semvslam
