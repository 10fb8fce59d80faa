#include "semvslam/semantic/segmentation_quality.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

/// alpha_k = 1, 1.5, 2 ..; beta_k = 2, 3, 4 ..; gamma_k = 4, 6, 8 ..
MissingSegmentationOptions plain_options() {
  MissingSegmentationOptions o;
  o.alpha = 1;
  o.alpha_step = 0.5;
  o.beta = 2;
  o.beta_step = 1;
  o.gamma = 4;
  o.gamma_step = 2;
  return o;
}

void expect_step(MissingSegmentationDetector& detector, std::uint32_t frame, int person_px, SegmentationState state,
                 int gap, int delta_px, double reference_px, bool updated) {
  const SegmentationQuality q = detector.step(FrameId(frame), person_px);
  EXPECT_EQ(q.state, state) << "frame " << frame << ": " << to_string(q.state);
  EXPECT_EQ(q.gap, gap) << "frame " << frame;
  EXPECT_EQ(q.delta_px, delta_px) << "frame " << frame;
  EXPECT_DOUBLE_EQ(q.reference_px, reference_px) << "frame " << frame;
  EXPECT_EQ(q.reference_updated, updated) << "frame " << frame;
  EXPECT_EQ(q.person_px, person_px);
}

constexpr auto kGood = SegmentationState::kQualified, kSlight = SegmentationState::kSlightLack,
               kSerious = SegmentationState::kSeriousLack;

TEST(MissingSegmentationDetector, StepsThroughEveryBranch) {
  MissingSegmentationDetector d(plain_options());
  expect_step(d, 0, 10000, kGood, 0, 0, 500, false);     // nothing to compare with
  expect_step(d, 1, 10300, kGood, 1, 300, 500, true);    // 25 <= 300 <= 500; L = 0: ref = 300
  expect_step(d, 2, 10310, kGood, 1, 10, 300, false);    // below 0.05 ref = 15
  expect_step(d, 3, 10610, kGood, 1, 300, 300, true);    // exactly alpha ref; L = 1: (300 + 300) / 2
  expect_step(d, 4, 10010, kGood, 1, -600, 300, false);  // exactly -beta ref is no lack, above alpha ref no update
  expect_step(d, 5, 9409, kSlight, 1, -601, 300, false);
  expect_step(d, 6, 8209, kSerious, 2, -1801, 300, false);  // k = 2: gamma ref = 1800, compared with frame 4
  expect_step(d, 7, 7610, kSlight, 3, -2400, 300, false);   // k = 3: exactly -gamma ref is slight
  expect_step(d, 8, 8811, kGood, 4, -1199, 300, false);     // k = 4: beta ref = 1500, alpha ref = 750
  expect_step(d, 9, 8826, kGood, 1, 15, 300, true);         // exactly 0.05 ref: (2 * 300 + 15) / 3
  EXPECT_DOUBLE_EQ(d.reference_px(), 205);
}

TEST(MissingSegmentationDetector, LossesUpdateTheReferenceToo) {
  MissingSegmentationDetector d(plain_options());
  d.step(FrameId(0), 5000);
  expect_step(d, 1, 4600, kGood, 1, -400, 500, true);
  EXPECT_DOUBLE_EQ(d.reference_px(), 400);
}

TEST(MissingSegmentationDetector, AlphaGrowsWithTheGap) {
  MissingSegmentationDetector d(plain_options());
  d.step(FrameId(0), 5000);
  expect_step(d, 2, 5750, kGood, 2, 750, 500, true);  // alpha_2 ref = 750
  MissingSegmentationDetector e(plain_options());
  e.step(FrameId(0), 5000);
  expect_step(e, 1, 5750, kGood, 1, 750, 500, false);
}

TEST(MissingSegmentationDetector, ComparesWithQualifiedResultsOfTheLastNFramesOnly) {
  MissingSegmentationDetector d(plain_options());
  d.step(FrameId(0), 20000);
  for (std::uint32_t frame = 1; frame <= 5; ++frame)
    expect_step(d, frame, 100, kSerious, static_cast<int>(frame), -19900, 500, false);
  expect_step(d, 6, 100, kGood, 0, 0, 500, false);  // k would be 6
  expect_step(d, 7, 120, kGood, 1, 20, 500, false);
}

TEST(MissingSegmentationDetector, FullQueueDropsItsFront) {
  MissingSegmentationOptions o = plain_options();
  o.queue = 3;
  o.alpha = 10;
  o.beta = 20;
  o.gamma = 40;
  MissingSegmentationDetector d(o);
  int n = 10000;
  d.step(FrameId(0), n);
  expect_step(d, 1, n += 100, kGood, 1, 100, 500, true);
  expect_step(d, 2, n += 200, kGood, 1, 200, 100, true);
  expect_step(d, 3, n += 300, kGood, 1, 300, 150, true);  // (2 * 150 + 300) / 3
  expect_step(d, 4, n += 400, kGood, 1, 400, 200, true);  // full: (3 * 200 - 100 + 400) / 3
  expect_step(d, 5, n += 300, kGood, 1, 300, 300, true);  // (3 * 300 - 200 + 300) / 3
  EXPECT_DOUBLE_EQ(d.reference_px(), 1000.0 / 3);
}

TEST(MissingSegmentationDetector, QueueHoldsTwentyByDefault) {
  MissingSegmentationOptions o = plain_options();
  o.alpha = 100;
  o.beta = 200;
  o.gamma = 400;
  MissingSegmentationDetector d(o);
  int n = 0;
  d.step(FrameId(0), n);
  d.step(FrameId(1), n += 1000);  // the front
  for (std::uint32_t frame = 2; frame <= 20; ++frame) d.step(FrameId(frame), n += 100);
  EXPECT_NEAR(d.reference_px(), (1000 + 19 * 100) / 20.0, 1e-9);
  d.step(FrameId(21), n += 100);
  EXPECT_NEAR(d.reference_px(), 100, 1e-9);
}

TEST(MissingSegmentationDetector, FrameThatIsNotLaterStartsANewHistoryAndKeepsTheReference) {
  MissingSegmentationDetector d(plain_options());
  d.step(FrameId(7), 10000);
  d.step(FrameId(8), 10300);
  expect_step(d, 8, 10, kGood, 0, 0, 300, false);
  expect_step(d, 2, 10, kGood, 0, 0, 300, false);
}

TEST(MissingSegmentationDetector, MissingFrameIsSeriousAndLeavesTheHistoryAlone) {
  MissingSegmentationDetector d(plain_options());
  d.step(FrameId(0), 10000);
  EXPECT_EQ(d.missing().state, kSerious);
  EXPECT_EQ(d.missing().person_px, 0);
  expect_step(d, 2, 8499, kSlight, 2, -1501, 500, false);
}

TEST(MissingSegmentationDetector, ResetForgetsReferenceAndHistory) {
  MissingSegmentationDetector d(plain_options());
  d.step(FrameId(0), 10000);
  d.step(FrameId(1), 10300);
  d.reset();
  expect_step(d, 2, 10, kGood, 0, 0, 500, false);
}

TEST(MissingSegmentationOptions, ThresholdsMustBeInOrderForEveryGap) {
  EXPECT_TRUE(MissingSegmentationOptions().check().ok());
  MissingSegmentationOptions o = plain_options();
  o.beta_step = 3;
  const Status s = o.check();
  ASSERT_FALSE(s.ok());
  EXPECT_NE(s.error().message.find("k = 3"), std::string::npos) << s.error().message;  // 8 = 8
  o = plain_options();
  o.alpha = 0;
  EXPECT_FALSE(o.check().ok());
}

TEST(MissingSegmentationOptions, EveryNumberIsAnOption) {
  MissingSegmentationOptions o;
  ConfigSchema schema;
  o.add_to(schema);
  EXPECT_EQ(schema.keys().size(), 10u);
  ASSERT_TRUE(schema.set("repair.history=3").ok());
  ASSERT_TRUE(schema.set("repair.first_reference=200").ok());
  EXPECT_EQ(o.history, 3);
  EXPECT_EQ(MissingSegmentationDetector(o).reference_px(), 200);
}

}  // namespace
}  // namespace semvslam
