#include "semvslam/semantic/segmentation_repair.h"

#include <gtest/gtest.h>

#include <map>

#include "semvslam/semantic/repair_test_support.h"

namespace semvslam {
namespace {

const Cutout kWalker{"person", {40, 60}, {50, 140}, 2.0, 1, true};
const Cutout kOther{"person", {220, 70}, {45, 130}, 1.5, 2, false};

RepairOptions in_mode(const std::string& mode) {
  RepairOptions o;
  o.mode = mode;
  return o;
}

/// Feeds views one after the other; what the segmenter gives is the truth unless told otherwise.
class Feeder {
 public:
  explicit Feeder(const RepairOptions& options) : repair_(scene.camera(), options) {}

  RepairedSegmentation feed(const TestView& view, const Segmentation* given) {
    const FrameId frame = view.truth.frame;
    return repair_.process({frame, view.truth.stamp, view.gray, view.depth, given, {}});
  }
  RepairedSegmentation feed(const TestView& view) { return feed(view, &view.truth); }
  SegmentationRepair& repair() { return repair_; }

  const TestScene scene;

 private:
  SegmentationRepair repair_;
};

Segmentation without(const Segmentation& s, std::size_t dropped) {
  Segmentation out = s;
  out.instances.erase(out.instances.begin() + static_cast<std::ptrdiff_t>(dropped));
  return out;
}

double person_iou(const RepairedSegmentation& repaired, const TestView& view) {
  return mask_iou(repaired.segmentation.mask_of_class("person"), view.truth.mask_of_class("person"));
}

TEST(SegmentationRepair, PersonWhoVanishesInMidImageIsRestored) {
  Feeder f(in_mode("carry"));
  TrackId track;
  for (int i = 0; i < 4; ++i) {
    const RepairedSegmentation r = f.feed(f.scene.view(i, {moved(kWalker, 6 * i), kOther}));
    EXPECT_EQ(r.record.restored_px, 0);
    EXPECT_EQ(r.record.method, "none");
    track = r.segmentation.instances[0].track;  // the farther one comes first
  }
  for (int i = 4; i < 8; ++i) {
    const TestView view = f.scene.view(i, {moved(kWalker, 6 * i), kOther});
    const Segmentation given = without(view.truth, 0);
    const RepairedSegmentation r = f.feed(view, &given);
    ASSERT_EQ(r.segmentation.instances.size(), 2u) << i;
    const Instance& back = r.segmentation.instances[1];
    EXPECT_EQ(back.provenance, Provenance::kRestored);
    EXPECT_EQ(back.track, track);
    EXPECT_EQ(back.id, InstanceId(1));
    EXPECT_EQ(back.class_name, "person");
    EXPECT_EQ(r.segmentation.instances[0].provenance, Provenance::kSegmented);
    EXPECT_EQ(r.record.restored_instances, 1);
    EXPECT_GT(r.record.restored_px, 5000);
    EXPECT_EQ(r.record.method, "carry");
    EXPECT_GT(person_iou(r, view), 0.95) << i;
  }
  const RepairedSegmentation again = f.feed(f.scene.view(8, {moved(kWalker, 48), kOther}));
  EXPECT_EQ(again.segmentation.instances[0].track, track);
  EXPECT_EQ(again.segmentation.instances[0].provenance, Provenance::kSegmented);
}

TEST(SegmentationRepair, WholeFrameIsRestored) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {moved(kWalker, 6 * i), kOther}));
  const TestView view = f.scene.view(3, {moved(kWalker, 18), kOther});
  const RepairedSegmentation r = f.feed(view, nullptr);
  EXPECT_TRUE(r.record.missing);
  EXPECT_EQ(r.record.quality.state, SegmentationState::kSeriousLack);
  EXPECT_EQ(r.record.restored_instances, 2);
  EXPECT_GT(person_iou(r, view), 0.95);
  EXPECT_EQ(r.segmentation.frame, FrameId(3));
  EXPECT_EQ(r.segmentation.size, f.scene.size());
}

TEST(SegmentationRepair, PersonWhoLeavesThroughTheBorderIsNotRestored) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 7; ++i) f.feed(f.scene.view(i, {moved(kWalker, -16 * i)}));
  // 7: a strip of 3 px and the arm may be left, 8 and later: nothing
  for (int i = 8; i < 11; ++i) {
    const TestView view = f.scene.view(i, {moved(kWalker, -16 * i)});
    ASSERT_TRUE(view.truth.instances.empty());
    const RepairedSegmentation r = f.feed(view);
    EXPECT_EQ(r.segmentation.instances.size(), 0u) << i;
  }
}

TEST(SegmentationRepair, PersonWhoGoesBehindSomethingNearerIsNotRestored) {
  Feeder f(in_mode("carry"));
  const Cutout cupboard{"", {130, 20}, {120, 210}, 1.0, 7};
  for (int i = 0; i < 20; ++i) {
    const TestView view = f.scene.view(i, {moved(kWalker, 8 * i), cupboard});
    const RepairedSegmentation r = f.feed(view);
    const cv::Mat found = r.segmentation.mask_of_class("person"), truth = view.truth.mask_of_class("person");
    EXPECT_LT(cv::countNonZero(found & ~truth), 350) << i;  // 150 px of outline
  }
}

TEST(SegmentationRepair, PersonWhoIsGoneIsNotRestored) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {kWalker}));
  EXPECT_EQ(f.feed(f.scene.view(3, {})).segmentation.instances.size(), 0u);
}

TEST(SegmentationRepair, WhatWasSeenOnceOnlyIsNotRestored) {
  Feeder f(in_mode("carry"));
  f.feed(f.scene.view(0, {kWalker}));
  EXPECT_EQ(f.feed(f.scene.view(1, {kWalker}), nullptr).record.restored_instances, 0);
}

TEST(SegmentationRepair, SecondMaskOfOneObjectIsNotMissed) {
  Feeder f(in_mode("carry"));
  const auto with_second = [&](const TestView& view) {
    Segmentation s = view.truth;
    Instance second = s.instances[0];  // the same person and the furniture around her
    const cv::Rect first = second.window;
    second.window = cv::Rect(first.x - 30, first.y - 30, first.width + 60, first.height + 60);
    second.mask = cv::Mat(second.window.size(), CV_8UC1, cv::Scalar(255));
    second.box = cv::Rect2f(second.window);
    second.id = InstanceId(1);
    s.instances.push_back(second);
    return s;
  };
  for (int i = 0; i < 4; ++i) {
    const TestView view = f.scene.view(i, {kWalker});
    const Segmentation given = with_second(view);
    ASSERT_EQ(f.feed(view, &given).segmentation.instances.size(), 2u);
  }
  const RepairedSegmentation one = f.feed(f.scene.view(4, {kWalker}));
  EXPECT_EQ(one.record.restored_instances, 0);
  EXPECT_EQ(one.segmentation.instances.size(), 1u);
}

TEST(SegmentationRepair, CarryingEndsAfterTheGivenNumberOfFrames) {
  RepairOptions o = in_mode("carry");
  o.memory.longest_carry = 4;
  Feeder f(o);
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {kWalker}));
  for (int i = 3; i < 10; ++i) {
    const RepairedSegmentation r = f.feed(f.scene.view(i, {kWalker}), nullptr);
    EXPECT_EQ(r.record.restored_instances, i < 7 ? 1 : 0) << i;
  }
}

TEST(SegmentationRepair, LostLimbComesBack) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {moved(kWalker, 4 * i)}));
  for (int i = 3; i < 6; ++i) {
    const TestView view = f.scene.view(i, {moved(kWalker, 4 * i)});
    Segmentation given = view.truth;
    given.instances[0].mask = given.instances[0].mask.clone();
    given.instances[0].mask.rowRange(0, 50).setTo(0);  // head, shoulders and part of the arm
    const RepairedSegmentation r = f.feed(view, &given);
    ASSERT_EQ(r.segmentation.instances.size(), 1u);
    EXPECT_EQ(r.segmentation.instances[0].provenance, Provenance::kExtended);
    EXPECT_EQ(r.record.extended_instances, 1);
    EXPECT_GT(person_iou(r, view), 0.96) << i;
  }
  EXPECT_EQ(f.feed(f.scene.view(6, {moved(kWalker, 24)})).record.extended_instances, 0);
}

TEST(SegmentationRepair, ArmThatIsDrawnInStaysAway) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {kWalker}));
  Cutout armless = kWalker;
  armless.arm = false;
  const TestView view = f.scene.view(3, {armless});
  const RepairedSegmentation r = f.feed(view);
  EXPECT_EQ(r.record.extended_instances, 0);
  EXPECT_EQ(person_iou(r, view), 1);
}

TEST(SegmentationRepair, CrossingPersonsKeepTheirIds) {
  Feeder f(in_mode("carry"));
  std::map<int, TrackId> first;  // by depth order: 0 = farther
  for (int i = 0; i < 12; ++i) {
    const Cutout child{"person", {160 - 5 * i, 110}, {45, 90}, 1.5, 2, false};  // hides half of the other
    const TestView view = f.scene.view(i, {moved(kWalker, 30 + 5 * i), child});
    const RepairedSegmentation r = f.feed(view);
    for (int n = 0; n < 2; ++n) {
      const TrackId track = r.segmentation.instances.at(static_cast<std::size_t>(n)).track;
      EXPECT_EQ(first.emplace(n, track).first->second, track) << "frame " << i << " person " << n;
    }
  }
}

TEST(SegmentationRepair, ThingsThatDoNotMoveByThemselvesAreLeftAlone) {
  Feeder f(in_mode("carry"));
  const Cutout chair{"chair", {100, 100}, {60, 80}, 2.0, 4};
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {chair}));
  EXPECT_EQ(f.feed(f.scene.view(3, {chair}), nullptr).segmentation.instances.size(), 0u);
}

TEST(SegmentationRepair, PasteSuperimposesTheFullestRecentMaskWhereItWas) {
  Feeder f(in_mode("paste"));
  const TestView fullest = f.scene.view(0, {kWalker, kOther});
  f.feed(fullest);
  f.feed(f.scene.view(1, {moved(kWalker, 4), moved(kOther, 1)}));
  const TestView view = f.scene.view(2, {moved(kWalker, 8), kOther});
  const RepairedSegmentation r = f.feed(view, nullptr);
  EXPECT_EQ(r.record.method, "paste");
  EXPECT_EQ(r.record.restored_instances, 2);
  // Both earlier frames have the same number of pixels: the later one is taken.
  const cv::Mat expected = f.scene.view(1, {moved(kWalker, 4), moved(kOther, 1)}).truth.mask_of_class("person");
  EXPECT_EQ(cv::countNonZero(r.segmentation.mask_of_class("person") != expected), 0);
  // A result that is 6 frames old is too old.
  const RepairedSegmentation late = f.feed(f.scene.view(7, {kWalker}), nullptr);
  EXPECT_EQ(late.record.restored_instances, 0);
}

TEST(SegmentationRepair, PasteFollowsTheRuleOnPartlyMissingFrames) {
  RepairOptions o = in_mode("paste");
  o.quality.beta = 4;
  o.quality.gamma = 8;
  Feeder f(o);
  const TestView view = f.scene.view(0, {kWalker, kOther});
  f.feed(view);
  Segmentation given = without(f.scene.view(1, {kWalker, kOther}).truth, 0);
  const RepairedSegmentation r = f.feed(f.scene.view(1, {kWalker, kOther}), &given);
  EXPECT_EQ(r.record.quality.state, SegmentationState::kSeriousLack);
  EXPECT_LT(r.record.quality.delta_px, -7000);
  EXPECT_EQ(r.record.restored_px, -r.record.quality.delta_px);
  EXPECT_EQ(person_iou(r, view), 1);
}

TEST(SegmentationRepair, OffChangesNothing) {
  Feeder f(in_mode("off"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {kWalker}));
  const RepairedSegmentation r = f.feed(f.scene.view(3, {kWalker}), nullptr);
  EXPECT_TRUE(r.segmentation.instances.empty());
  EXPECT_EQ(r.record.method, "none");
  EXPECT_TRUE(r.record.missing);
}

TEST(SegmentationRepair, LateSegmentationIsCarriedToThePresentFrame) {
  Feeder f(in_mode("carry"));
  const TestView first = f.scene.view(0, {kWalker});
  f.feed(first, nullptr);
  f.feed(f.scene.view(1, {moved(kWalker, 5)}), nullptr);
  const TestView present = f.scene.view(2, {moved(kWalker, 10)});
  const RepairedSegmentation r = f.feed(present, &first.truth);
  EXPECT_EQ(r.record.age_frames, 2);
  EXPECT_FALSE(r.record.missing);
  EXPECT_GT(person_iou(r, present), 0.95);
  EXPECT_EQ(r.segmentation.frame, FrameId(2));
  // Older than what is kept
  for (int i = 3; i < 30; ++i) f.feed(f.scene.view(i, {}));
  const RepairedSegmentation too_late = f.feed(f.scene.view(30, {kWalker}), &first.truth);
  EXPECT_TRUE(too_late.record.missing);
  EXPECT_NE(too_late.record.note.find("30 frames late"), std::string::npos) << too_late.record.note;
}

TEST(SegmentationRepair, MaskOfWrongSizeCountsAsMissing) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {kWalker}));
  const TestView view = f.scene.view(3, {kWalker});
  Segmentation wrong = view.truth;
  wrong.size = {640, 480};
  RepairedSegmentation r = f.feed(view, &wrong);
  EXPECT_TRUE(r.record.missing);
  EXPECT_EQ(r.record.note, "segmentation of 640x480 does not fit the image of 320x240: left out");
  EXPECT_GT(person_iou(r, view), 0.95);
  wrong = f.scene.view(4, {kWalker}).truth;
  wrong.instances[0].window.x = 300;  // beyond the image
  r = f.feed(f.scene.view(4, {kWalker}), &wrong);
  EXPECT_TRUE(r.record.missing);
  EXPECT_EQ(r.record.restored_instances, 1);
}

TEST(SegmentationRepair, ImagesThatDoNotFitAreLeftOut) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {kWalker}));
  TestView view = f.scene.view(3, {kWalker});
  view.depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(5000));
  view.gray = cv::Mat(view.gray.size(), CV_8UC3, cv::Scalar::all(0));
  const RepairedSegmentation r = f.feed(view, nullptr);
  EXPECT_NE(r.record.note.find("gray image"), std::string::npos) << r.record.note;
  EXPECT_NE(r.record.note.find("depth image"), std::string::npos) << r.record.note;
  EXPECT_GT(person_iou(r, view), 0.97);  // she did not move
}

TEST(SegmentationRepair, NothingButFrameNumbersIsNoFault) {
  Feeder f(in_mode("carry"));
  for (std::uint32_t i = 0; i < 3; ++i) {
    const RepairedSegmentation r = f.repair().process({FrameId(i), TimeStamp{i * 1000}, {}, {}, nullptr, {}});
    EXPECT_TRUE(r.record.missing);
    EXPECT_TRUE(r.segmentation.instances.empty());
    EXPECT_EQ(r.segmentation.size, f.scene.size());
  }
}

TEST(SegmentationRepair, EmptyDepthImageOfASensorThatSeesNothing) {
  Feeder f(in_mode("carry"));
  RepairedSegmentation r;
  TestView view;
  for (int i = 0; i < 4; ++i) {
    view = f.scene.view(i, {moved(kWalker, 5 * i)});
    view.depth.setTo(0);
    r = f.feed(view, i < 3 ? &view.truth : nullptr);
  }
  EXPECT_GT(person_iou(r, view), 0.9);
}

TEST(SegmentationRepair, TimeJumpStartsAnew) {
  Feeder f(in_mode("carry"));
  for (int i = 0; i < 3; ++i) f.feed(f.scene.view(i, {kWalker}));
  TestView view = f.scene.view(3, {kWalker});
  view.truth.stamp.ns += 2'000'000'000;
  RepairedSegmentation r = f.feed(view, nullptr);
  EXPECT_EQ(r.record.restored_instances, 0);
  EXPECT_NE(r.record.note.find("starts anew"), std::string::npos);
  r = f.feed(f.scene.view(1, {kWalker}), nullptr);  // backwards
  EXPECT_EQ(r.record.restored_instances, 0);
  EXPECT_NE(r.record.note.find("not later"), std::string::npos);
}

TEST(SegmentationRepair, SegmentationOfALaterFrameIsLeftOut) {
  Feeder f(in_mode("carry"));
  const Segmentation later = f.scene.view(9, {kWalker}).truth;
  const RepairedSegmentation r = f.feed(f.scene.view(3, {kWalker}), &later);
  EXPECT_TRUE(r.record.missing);
  EXPECT_TRUE(r.segmentation.instances.empty());
}

TEST(RepairOptions, AreAConfigurationSection) {
  RepairOptions o;
  ConfigSchema schema;
  o.add_to(schema);
  ASSERT_TRUE(schema.set("repair.mode=paste").ok());
  ASSERT_TRUE(schema.set("repair.gamma=1").ok());
  EXPECT_FALSE(schema.set("repair.mode=glue").ok());
  EXPECT_EQ(o.mode, "paste");
  EXPECT_FALSE(o.check().ok());  // gamma below beta
}

}  // namespace
}  // namespace semvslam
