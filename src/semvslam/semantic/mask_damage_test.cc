#include "semvslam/semantic/mask_damage.h"

#include <gtest/gtest.h>

#include "semvslam/semantic/repair_experiment.h"
#include "semvslam/semantic/repair_test_support.h"

namespace semvslam {
namespace {

Segmentation three_things(std::uint32_t frame) {
  static const Segmentation made = TestScene()
                                       .view(0, {{"person", {20, 40}, {50, 150}, 2.0, 1, true},
                                                 {"person", {200, 60}, {60, 130}, 1.8, 2, false},
                                                 {"chair", {110, 120}, {50, 70}, 1.5, 3, false}})
                                       .truth;
  Segmentation s = made;
  s.frame = FrameId(frame);
  return s;
}

MaskDamageOptions damage(const std::string& kind, double share) {
  MaskDamageOptions o;
  o.kind = kind;
  o.share = share;
  return o;
}

TEST(MaskDamage, NoneAndZeroChangeNothing) {
  const Segmentation whole = three_things(5);
  for (const MaskDamageOptions& o : {damage("none", 1), damage("frames", 0), damage("limbs", 0)}) {
    const auto out = MaskDamage(o).apply(whole);
    ASSERT_TRUE(out.has_value());
    EXPECT_EQ(cv::countNonZero(out->labels() != whole.labels()), 0);
  }
}

TEST(MaskDamage, DropsTheShareOfFrames) {
  const MaskDamage d(damage("frames", 0.3));
  int dropped = 0;
  for (std::uint32_t i = 0; i < 2000; ++i) dropped += !d.apply({FrameId(i), {}, {320, 240}, {}});
  EXPECT_NEAR(dropped, 600, 65);  // three sigma
}

TEST(MaskDamage, DropsTheShareOfPersonsAndNothingElse) {
  const MaskDamage d(damage("instances", 0.5));
  int persons = 0;
  for (std::uint32_t i = 0; i < 400; ++i) {
    const auto out = d.apply(three_things(i));
    ASSERT_TRUE(out.has_value());
    int chairs = 0;
    for (std::size_t n = 0; n < out->instances.size(); ++n) {
      EXPECT_EQ(out->instances[n].id, InstanceId(static_cast<std::uint32_t>(n)));
      persons += out->instances[n].class_name == "person";
      chairs += out->instances[n].class_name == "chair";
    }
    EXPECT_EQ(chairs, 1);
  }
  EXPECT_NEAR(persons, 400, 45);
}

TEST(MaskDamage, LimbsTakeBetweenTheGivenShares) {
  const MaskDamage d(damage("limbs", 1));
  for (std::uint32_t i = 0; i < 50; ++i) {
    const Segmentation whole = three_things(i);
    const auto out = d.apply(whole);
    ASSERT_EQ(out->instances.size(), 3u);
    for (std::size_t n = 0; n < 3; ++n) {
      const Instance &a = whole.instances[n], &b = out->instances[n];
      const double left = static_cast<double>(cv::countNonZero(b.mask)) / cv::countNonZero(a.mask);
      EXPECT_EQ(b.mask.size(), b.window.size());
      if (a.class_name == "chair") {
        EXPECT_EQ(left, 1);
      } else {
        EXPECT_GE(left, 0.65 - 1e-3);
        EXPECT_LE(left, 0.90 + 1e-3);
      }
      const cv::Mat before = whole_image(a.window, a.mask, whole.size),
                    after = whole_image(b.window, b.mask, whole.size);
      EXPECT_EQ(cv::countNonZero(after & ~before), 0);
    }
  }
}

TEST(MaskDamage, DependsOnSeedAndFrameOnly) {
  const MaskDamage a(damage("limbs", 0.5)), b(damage("limbs", 0.5));
  MaskDamageOptions other = damage("limbs", 0.5);
  other.seed = 2;
  const MaskDamage c(other);
  int differs = 0;
  for (std::uint32_t i = 0; i < 20; ++i) b.apply(three_things(i));  // another order of questions
  for (std::uint32_t i = 20; i-- > 0;) {
    const Segmentation whole = three_things(i);
    const cv::Mat labels = a.apply(whole)->labels();
    EXPECT_EQ(cv::countNonZero(labels != b.apply(whole)->labels()), 0);
    differs += cv::countNonZero(labels != c.apply(whole)->labels()) > 0;
  }
  EXPECT_GT(differs, 10);
}

TEST(MaskDamage, FramesOfARunShareTheirFate) {
  MaskDamageOptions o = damage("frames", 0.5);
  o.run = 5;
  const MaskDamage d(o);
  int dropped = 0;
  for (std::uint32_t block = 0; block < 100; ++block) {
    const bool first = d.apply({FrameId(5 * block), {}, {320, 240}, {}}).has_value();
    dropped += !first;
    for (std::uint32_t i = 1; i < 5; ++i)
      EXPECT_EQ(d.apply({FrameId(5 * block + i), {}, {320, 240}, {}}).has_value(), first);
  }
  EXPECT_NEAR(dropped, 50, 16);
}

TEST(RepairExperiment, MeasuresWhatRepairIsWorth) {
  const TestScene scene;
  std::vector<RepairCase> cases(3);
  for (RepairCase& c : cases) c.damage = damage("frames", 0.3);
  cases[0].repair.mode = "off";
  cases[1].repair.mode = "paste";
  cases[2].repair.mode = "carry";
  RepairExperiment experiment(scene.camera(), cases);
  for (int i = 0; i < 30; ++i) {
    const TestView view = scene.view(i, {{"person", {20 + 6 * i, 60}, {50, 140}, 2.0, 1, true}});
    experiment.add({FrameId(static_cast<std::uint32_t>(i)), view.truth.stamp, view.gray, {}, view.depth, {}},
                   view.truth, view.truth.mask_of_class("person"), {});
  }
  const std::vector<RepairCaseScore> scores = experiment.scores();
  ASSERT_EQ(scores.size(), 3u);
  for (const RepairCaseScore& s : scores) {
    EXPECT_EQ(s.frames, 30);
    EXPECT_GT(s.damaged_frames, 4);
    EXPECT_EQ(s.detected_frames, s.damaged_frames);
    EXPECT_EQ(s.false_alarms, 0);
  }
  EXPECT_EQ(scores[0].damaged.recall(), 0);
  EXPECT_EQ(scores[0].damaged.precision(), -1);  // nothing found, nothing to measure
  EXPECT_EQ(scores[0].all.precision(), 1);
  EXPECT_GT(scores[2].damaged.recall(), scores[1].damaged.recall());
  EXPECT_GT(scores[2].damaged.precision(), scores[1].damaged.precision());
  EXPECT_EQ(scores[2].damaged_time.count, static_cast<std::uint64_t>(scores[2].damaged_frames));
}

TEST(ChangeStatistics, QuantilesPerGap) {
  MissingSegmentationOptions o;
  o.alpha = 0.001;  // the reference stays at 500
  ChangeStatistics statistics(o);
  const int counts[] = {1000, 1100, 900, 1400};
  for (std::uint32_t i = 0; i < 4; ++i) statistics.add(FrameId(i), counts[i]);
  EXPECT_EQ(statistics.count(1), 3u);
  EXPECT_EQ(statistics.count(3), 1u);
  EXPECT_DOUBLE_EQ(statistics.quantile(1, 1.0, false), 1.0);  // +500
  EXPECT_DOUBLE_EQ(statistics.quantile(1, 0.5, false), 0.4);  // 100, 200, 500
  EXPECT_DOUBLE_EQ(statistics.quantile(1, 1.0, true), 0.4);   // the one loss
  EXPECT_DOUBLE_EQ(statistics.quantile(3, 0.5, false), 0.8);
  EXPECT_EQ(statistics.quantile(4, 0.5, false), -1);
}

}  // namespace
}  // namespace semvslam
