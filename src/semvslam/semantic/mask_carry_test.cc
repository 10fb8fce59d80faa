#include "semvslam/semantic/mask_carry.h"

#include <gtest/gtest.h>

#include <limits>

#include "semvslam/semantic/repair_test_support.h"

namespace semvslam {
namespace {

const Cutout kPerson{"person", {100, 60}, {60, 140}, 2.0, 1, true};

struct Carried {
  CarriedMask result;
  double iou = 0;  // with the true mask of the first instance
};

Carried carry(const TestScene& scene, const TestView& from, const TestView& to, const MaskCarryOptions& options,
              const std::optional<SE3>& to_from = {}, cv::Point2f guess_px = {}) {
  const MaskCarry carrier(scene.camera(), options);
  const Instance& i = from.truth.instances.at(0);
  Carried out;
  out.result = carrier.carry({scene.camera(), from.gray, from.depth}, {scene.camera(), to.gray, to.depth}, i.window,
                             i.mask, to_from, guess_px);
  if (!to.truth.instances.empty())
    out.iou = mask_iou(whole_image(out.result.window, out.result.mask, scene.size()),
                       whole_image(to.truth.instances[0].window, to.truth.instances[0].mask, scene.size()));
  return out;
}

MaskCarryOptions by(const std::string& motion, int grow_px = 4) {
  MaskCarryOptions o;
  o.motion = motion;
  o.grow_px = grow_px;
  return o;
}

TEST(MaskCarry, FlowFollowsAPersonWhoMovesAgainstTheWall) {
  const TestScene scene;
  const TestView from = scene.view(0, {kPerson}), to = scene.view(1, {moved(kPerson, 17, -6, 0.1)}, {-9, 0});
  const Carried c = carry(scene, from, to, by("flow"));
  EXPECT_EQ(c.result.outcome, CarryOutcome::kVisible);
  EXPECT_GT(c.iou, 0.95);
  EXPECT_NEAR(c.result.shift_px.x, 17, 1);
  EXPECT_NEAR(c.result.shift_px.y, -6, 1);
  EXPECT_NEAR(c.result.depth_change_m, 0.1, 0.01);
  EXPECT_GT(c.result.flow_points, 20);
  EXPECT_LT(carry(scene, from, to, by("none", 0)).iou, 0.75);
}

TEST(MaskCarry, PoseMovesAPersonWhoStandsStill) {
  const TestScene scene;
  // The camera goes 0.1 m to the right: things 2 m away move by 260 * 0.1 / 2 = 13 px to the left.
  const SE3 to_from(Eigen::Quaterniond::Identity(), {-0.1, 0, 0});
  const TestView from = scene.view(0, {kPerson}), to = scene.view(1, {moved(kPerson, -13, 0)}, {-9, 0});
  const Carried c = carry(scene, from, to, by("pose", 0), to_from);
  EXPECT_EQ(c.result.outcome, CarryOutcome::kVisible);
  EXPECT_EQ(c.result.flow_points, 0);
  EXPECT_NEAR(c.result.shift_px.x, -13, 0.5);
  EXPECT_GT(c.iou, 0.95);
}

TEST(MaskCarry, WithoutImagesTheGuessMovesTheMask) {
  const TestScene scene;
  TestView from = scene.view(0, {kPerson}), to = scene.view(1, {moved(kPerson, 12, 4)});
  from.gray = to.gray = from.depth = to.depth = cv::Mat();
  const Carried c = carry(scene, from, to, by("flow"), {}, {12, 4});
  EXPECT_EQ(c.result.outcome, CarryOutcome::kVisible);
  EXPECT_EQ(c.result.support, 1.f);
  EXPECT_GT(c.iou, 0.97);
}

TEST(MaskCarry, NearerThingCutsItsPartAway) {
  const TestScene scene;
  const Cutout box{"", {70, 130}, {140, 90}, 1.0, 5};
  const TestView from = scene.view(0, {kPerson}), to = scene.view(1, {kPerson, box});
  const Carried c = carry(scene, from, to, by("flow"));
  EXPECT_EQ(c.result.outcome, CarryOutcome::kVisible);
  EXPECT_GT(c.iou, 0.93);
}

TEST(MaskCarry, SaysWhyAMaskIsNotThere) {
  const TestScene scene;
  const TestView from = scene.view(0, {kPerson});
  const Cutout box{"", {80, 40}, {140, 190}, 1.0, 5};
  EXPECT_EQ(carry(scene, from, scene.view(1, {kPerson, box}), by("flow")).result.outcome, CarryOutcome::kOccluded);
  EXPECT_EQ(carry(scene, from, scene.view(1, {}), by("flow")).result.outcome, CarryOutcome::kGone);
  const Carried left = carry(scene, from, scene.view(1, {}), by("none"), {}, {});
  EXPECT_EQ(left.result.outcome, CarryOutcome::kGone);
  EXPECT_TRUE(left.result.window.empty());
}

TEST(MaskCarry, MostlyOutsideTheImageHasLeft) {
  const TestScene scene;
  TestView from = scene.view(0, {moved(kPerson, 140, 0)}), to = scene.view(1, {});
  from.gray = cv::Mat();
  const Carried c = carry(scene, from, to, by("flow"), {}, {78, 0});
  EXPECT_EQ(c.result.outcome, CarryOutcome::kLeft);
  EXPECT_LT(c.result.inside, 0.15f);
}

TEST(MaskCarry, HolesInTheDepthStayCovered) {
  const TestScene scene;
  const TestView from = scene.view(0, {kPerson});
  TestView to = scene.view(1, {moved(kPerson, 5, 0)});
  for (int x = 100; x < 180; x += 16) to.depth.colRange(x, x + 8).setTo(0);
  const Carried c = carry(scene, from, to, by("flow"));
  EXPECT_EQ(c.result.outcome, CarryOutcome::kVisible);
  EXPECT_GT(c.iou, 0.93);
}

TEST(MaskCarry, TooCloseForTheSensorIsCarriedByFlowAlone) {
  const TestScene scene;
  TestView from = scene.view(0, {kPerson}), to = scene.view(1, {moved(kPerson, 8, 0)});
  from.depth.setTo(0, whole_image(from.truth.instances[0].window, from.truth.instances[0].mask, scene.size()));
  to.depth.setTo(0, whole_image(to.truth.instances[0].window, to.truth.instances[0].mask, scene.size()));
  EXPECT_GT(carry(scene, from, to, by("flow")).iou, 0.9);
}

TEST(MaskCarry, GrowsIntoConnectedPixelsOfFittingDepth) {
  const TestScene scene;
  TestView from = scene.view(0, {kPerson});
  const TestView to = scene.view(1, {kPerson});
  Instance& given = from.truth.instances[0];
  given.mask = given.mask.clone();
  given.mask.colRange(0, 6).setTo(0);
  const double without = carry(scene, from, to, by("flow", 0)).iou, with = carry(scene, from, to, by("flow", 10)).iou;
  EXPECT_LT(without, 0.94);
  EXPECT_GT(with, 0.98);
}

TEST(MaskCarry, PersonWhoFillsTheImage) {
  const TestScene scene;
  const Cutout near_one{"person", {60, 10}, {150, 225}, 0.9, 3, true};  // 43 %
  const TestView from = scene.view(0, {near_one}), to = scene.view(1, {moved(near_one, -14, 3, -0.05)});
  EXPECT_GT(carry(scene, from, to, by("flow")).iou, 0.97);
}

TEST(MaskCarry, MetresAndUnitsGiveTheSame) {
  const TestScene scene;
  TestView from = scene.view(0, {kPerson}), to = scene.view(1, {moved(kPerson, 6, 2)});
  const Carried units = carry(scene, from, to, by("flow"));
  for (TestView* v : {&from, &to}) {
    v->depth.convertTo(v->depth, CV_32F, 1 / scene.camera().depth_units_per_m);
    v->depth.at<float>(0, 0) = std::numeric_limits<float>::quiet_NaN();
  }
  const Carried metres = carry(scene, from, to, by("flow"));
  EXPECT_EQ(metres.result.window, units.result.window);
  EXPECT_EQ(metres.iou, units.iou);
}

TEST(MaskCarry, TinyMasksAreNoFault) {
  const TestScene scene;
  const TestView view = scene.view(0, {{"person", {0, 0}, {1, 1}, 2.0}, {"person", {317, 237}, {3, 3}, 2.0}});
  const MaskCarry carrier(scene.camera(), {});
  const CarryFrame frame(scene.camera(), view.gray, view.depth);
  for (const Instance& i : view.truth.instances) {
    const CarriedMask c = carrier.carry(frame, frame, i.window, i.mask, SE3());
    EXPECT_LE(c.window.area(), 400);
  }
  const CarriedMask none = carrier.carry(frame, frame, {10, 10, 0, 0}, cv::Mat(), SE3());
  EXPECT_TRUE(none.window.empty());
}

}  // namespace
}  // namespace semvslam
