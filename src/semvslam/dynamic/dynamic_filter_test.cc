#include "semvslam/dynamic/dynamic_filter.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "semvslam/geometry/mask_lookup.h"

namespace semvslam {
namespace {

constexpr int kWidth = 320, kHeight = 240;

Camera small_camera() {
  Camera camera;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.fx_px = camera.fy_px = 260;
  camera.cx_px = 159.5;
  camera.cy_px = 119.5;
  return camera;
}

/// A textured wall 3 m away and a textured board before it, 1.5 m away, that may be shifted.
RgbdFrame make_frame(std::uint32_t id, int board_x_px) {
  RgbdFrame frame;
  frame.id = FrameId(id);
  frame.stamp = TimeStamp{id * 33'333'333LL};
  cv::RNG random(7);
  frame.gray.create(kHeight, kWidth, CV_8UC1);
  random.fill(frame.gray, cv::RNG::UNIFORM, 0, 256);
  cv::Mat board(100, 80, CV_8UC1);
  random.fill(board, cv::RNG::UNIFORM, 0, 256);
  frame.depth = cv::Mat(kHeight, kWidth, CV_32FC1, cv::Scalar(3.0));
  const cv::Rect place(board_x_px, 70, 80, 100);
  board.copyTo(frame.gray(place));
  cv::GaussianBlur(frame.gray, frame.gray, {}, 1.5);
  frame.depth(place).setTo(1.5);
  return frame;
}

Instance make_instance(Role role, const cv::Rect& window, float score) {
  Instance instance;
  instance.class_name = role == Role::kDynamic ? "person" : "chair";
  instance.role = role;
  instance.score = score;
  instance.window = window;
  instance.box = window;
  instance.mask = cv::Mat(window.size(), CV_8UC1, cv::Scalar(255));
  return instance;
}

Segmentation make_segmentation(FrameId frame, std::vector<Instance> instances) {
  Segmentation segmentation;
  segmentation.frame = frame;
  segmentation.size = {kWidth, kHeight};
  segmentation.instances = std::move(instances);
  return segmentation;
}

/// Points on a raster, as features would be.
std::vector<cv::Point2f> raster() {
  std::vector<cv::Point2f> points;
  for (int y = 16; y < kHeight - 16; y += 9)
    for (int x = 16; x < kWidth - 16; x += 9) points.emplace_back(static_cast<float>(x), static_cast<float>(y));
  return points;
}

std::vector<float> depths_at(const std::vector<cv::Point2f>& points, const cv::Mat& depth) {
  std::vector<float> depths;
  for (const cv::Point2f& p : points) depths.push_back(depth.at<float>(cvRound(p.y), cvRound(p.x)));
  return depths;
}

DynamicOptions with(const std::string& masks, bool motion) {
  DynamicOptions options;
  options.masks = masks;
  options.motion = motion;
  options.restoration.mode = "off";
  return options;
}

TEST(DynamicFilter, WithoutEvidenceNothingIsLeftOut) {
  DynamicFilter filter(small_camera(), with("off", false));
  const RgbdFrame frame = make_frame(0, 100);
  const Segmentation person = make_segmentation(frame.id, {make_instance(Role::kDynamic, {10, 10, 50, 50}, 0.9f)});
  filter.begin(frame, &person, std::nullopt);
  EXPECT_TRUE(filter.excluded().empty());
  const std::vector<cv::Point2f> points = raster();
  const auto& usable = filter.judge(points, depths_at(points, frame.depth));
  EXPECT_EQ(std::count(usable.begin(), usable.end(), 1), static_cast<std::ptrdiff_t>(points.size()));
  filter.end(SE3(), {});
  EXPECT_EQ(filter.record()->count(FeatureVerdict::kUnknown), static_cast<int>(points.size()));
  EXPECT_EQ(filter.record()->mask_source, MaskSource::kNone);
}

TEST(DynamicFilter, MasksOfDynamicClassesAreExcludedWithAnOutlineOfDoubt) {
  DynamicOptions options = with("masks", false);
  options.dilate_px = 3;
  options.fit.band_px = 0;  // the pictures' depth knows nothing of this person
  DynamicFilter filter(small_camera(), options);
  const RgbdFrame frame = make_frame(0, 100);
  Instance person = make_instance(Role::kDynamic, {40, 40, 50, 60}, 0.9f);
  person.mask.rowRange(30, 60).setTo(0);  // the box is twice as high as what was segmented
  const Segmentation segmentation =
      make_segmentation(frame.id, {person, make_instance(Role::kMovable, {200, 40, 50, 60}, 0.9f)});
  filter.begin(frame, &segmentation, std::nullopt);
  cv::Mat core = cv::Mat::zeros(kHeight, kWidth, CV_8UC1);
  core(cv::Rect(43, 43, 44, 24)).setTo(255);
  EXPECT_EQ(cv::norm(filter.excluded(), core, cv::NORM_INF), 0);
  EXPECT_EQ(filter.record()->mask_source, MaskSource::kSegmented);

  const std::vector<cv::Point2f> pixels{{42, 50}, {38, 50}, {36, 50}, {220, 60}};
  const std::vector<std::uint8_t> usable = filter.judge(pixels, std::vector<float>(pixels.size(), 3.f));
  EXPECT_EQ(usable, (std::vector<std::uint8_t>{kKnownLandmarkOnly, kKnownLandmarkOnly, kFullyUsed, kFullyUsed}));
  EXPECT_EQ(filter.record()->features[0].reason, FeatureReason::kAtOutline);
  EXPECT_EQ(cv::norm(filter.record()->left_out.at(0), core, cv::NORM_INF), 0);
  cv::Mat grown = cv::Mat::zeros(kHeight, kWidth, CV_8UC1);
  grown(cv::Rect(37, 37, 56, 36)).setTo(255);
  EXPECT_EQ(cv::norm(filter.record()->moving, grown, cv::NORM_INF), 0);

  options.masks = "boxes";
  DynamicFilter boxes(small_camera(), options);
  boxes.begin(frame, &segmentation, std::nullopt);
  core(cv::Rect(43, 43, 44, 54)).setTo(255);
  EXPECT_EQ(cv::norm(boxes.excluded(), core, cv::NORM_INF), 0);

  options.dilate_px = 0;
  DynamicFilter sharp(small_camera(), options);
  sharp.begin(frame, &segmentation, std::nullopt);
  core(cv::Rect(40, 40, 50, 60)).setTo(255);
  EXPECT_EQ(cv::norm(sharp.excluded(), core, cv::NORM_INF), 0) << "no doubt, no outline";
}

TEST(DynamicFilter, AGivenMaskCountsInEveryMode) {
  DynamicFilter filter(small_camera(), with("off", false));
  RgbdFrame frame = make_frame(0, 100);
  frame.mask = cv::Mat::zeros(kHeight, kWidth, CV_8UC1);
  frame.mask(cv::Rect(100, 100, 20, 20)).setTo(7);
  filter.begin(frame, nullptr, std::nullopt);
  EXPECT_NE(filter.excluded().at<std::uint8_t>(110, 110), 0);
  EXPECT_EQ(filter.excluded().at<std::uint8_t>(50, 50), 0);
  EXPECT_EQ(filter.record()->mask_source, MaskSource::kGiven);
}

TEST(DynamicFilter, AFrameFullOfPersonsOpensTheWeakestMasksFirst) {
  DynamicFilter filter(small_camera(), with("masks", false));
  const RgbdFrame frame = make_frame(0, 100);
  const Segmentation crowd =
      make_segmentation(frame.id, {make_instance(Role::kDynamic, {0, 0, kWidth / 2, kHeight}, 0.95f),
                                   make_instance(Role::kDynamic, {kWidth / 2, 0, kWidth / 2, kHeight}, 0.6f)});
  filter.begin(frame, &crowd, std::nullopt);
  EXPECT_EQ(cv::countNonZero(filter.excluded()), kWidth * kHeight);
  ASSERT_TRUE(filter.relax(0));
  EXPECT_NE(filter.excluded().at<std::uint8_t>(120, 20), 0) << "the better one still masks";
  EXPECT_EQ(filter.excluded().at<std::uint8_t>(120, 300), 0);
  EXPECT_EQ(filter.record()->fail_open, FailOpen::kSemantic);
  EXPECT_FALSE(filter.relax(1000)) << "enough features: nothing more is opened";
  EXPECT_TRUE(filter.relax(0));
  EXPECT_FALSE(filter.relax(0)) << "nothing is left to open";
  EXPECT_TRUE(filter.excluded().empty() || cv::countNonZero(filter.excluded()) == 0);
}

TEST(DynamicFilter, AMaskOfAnotherSizeIsLeftOutAndTheRecordSaysSo) {
  DynamicFilter filter(small_camera(), with("masks", false));
  const RgbdFrame frame = make_frame(0, 100);
  Segmentation segmentation = make_segmentation(frame.id, {make_instance(Role::kDynamic, {600, 400, 20, 20}, 0.9f)});
  segmentation.size = {640, 480};
  filter.begin(frame, &segmentation, std::nullopt);
  EXPECT_TRUE(filter.excluded().empty() || cv::countNonZero(filter.excluded()) == 0);
  EXPECT_FALSE(filter.record()->repair.note.empty());
}

/// Runs a board that moves by `step_px` a frame past a still camera.
std::shared_ptr<const DynamicRecord> move_board(DynamicFilter& filter, int step_px, bool with_chair) {
  const std::vector<cv::Point2f> points = raster();
  for (std::uint32_t i = 0; i < 12; ++i) {
    const int x = 60 + static_cast<int>(i) * step_px;
    const RgbdFrame frame = make_frame(i, x);
    Segmentation chair = make_segmentation(frame.id, {});
    if (with_chair) chair.instances.push_back(make_instance(Role::kMovable, {x, 70, 80, 100}, 0.8f));
    filter.begin(frame, &chair, i > 0 ? std::optional<SE3>(SE3()) : std::nullopt);
    (void)filter.judge(points, depths_at(points, frame.depth));
    filter.end(SE3(), {});
  }
  return filter.record();
}

TEST(DynamicFilter, AMovingThingOfNoClassIsFoundByMotionAlone) {
  DynamicFilter filter(small_camera(), with("off", true));
  const auto record = move_board(filter, 4, false);
  int moving_on_board = 0, on_board = 0, used_on_board = 0, moving_on_wall = 0, on_wall = 0;
  const cv::Rect board(60 + 11 * 4, 70, 80, 100), inside(board.x + 4, board.y + 4, board.width - 8, board.height - 8);
  const cv::Rect near_board(board.x - 14, board.y - 14, board.width + 28, board.height + 28);
  for (const FeatureMark& mark : record->features) {
    const bool moving = mark.verdict == FeatureVerdict::kMoving;
    if (board.contains(mark.pixel)) used_on_board += mark.use == kFullyUsed;
    if (inside.contains(mark.pixel)) {
      ++on_board;
      moving_on_board += moving;
    } else if (!near_board.contains(mark.pixel)) {
      ++on_wall;
      moving_on_wall += moving;
    }
  }
  EXPECT_GT(moving_on_board, on_board * 9 / 10);
  EXPECT_LE(used_on_board, on_board / 20) << "what is not known to move lies at the outline";
  EXPECT_LE(moving_on_wall, on_wall / 100);
  EXPECT_GE(record->moving_regions, 1);
}

TEST(DynamicFilter, NoFeaturesAreExtractedWhereAMoverIsExpectedUnlessTooFewAreLeft) {
  DynamicFilter filter(small_camera(), with("off", true));
  (void)move_board(filter, 4, false);
  const RgbdFrame frame = make_frame(12, 60 + 12 * 4);
  filter.begin(frame, nullptr, SE3());
  ASSERT_FALSE(filter.excluded().empty());
  const cv::Rect board(60 + 12 * 4, 70, 80, 100),
      inside(board.x + 15, board.y + 15, board.width - 30, board.height - 30);
  EXPECT_GT(cv::countNonZero(filter.excluded()(inside)), inside.area() * 9 / 10);
  cv::Mat elsewhere = filter.excluded().clone();
  elsewhere(cv::Rect(board.x - 14, board.y - 14, board.width + 28, board.height + 28)).setTo(0);
  EXPECT_EQ(cv::countNonZero(elsewhere), 0);
  EXPECT_FALSE(filter.relax(1000));
  EXPECT_TRUE(filter.relax(0));
  EXPECT_TRUE(filter.excluded().empty()) << "opened: what is found there is judged point by point";
  EXPECT_FALSE(filter.relax(0)) << "nothing is left to open";
}

TEST(DynamicFilter, AMovableInstanceIsLeftOutOnlyWhenItMoves) {
  DynamicFilter moving(small_camera(), with("masks", true));
  EXPECT_EQ(move_board(moving, 4, true)->moving_instances, 1);
  DynamicFilter still(small_camera(), with("masks", true));
  const auto record = move_board(still, 0, true);
  EXPECT_EQ(record->moving_instances, 0);
  EXPECT_EQ(record->count(FeatureVerdict::kMoving), 0);
}

/// Steps with a board that is a person at `x_px`. @return the verdicts on a raster of points.
std::vector<std::uint8_t> step_person(DynamicFilter& filter, std::uint32_t i, int x_px) {
  const std::vector<cv::Point2f> points = raster();
  const RgbdFrame frame = make_frame(i, x_px);
  const Segmentation seen = make_segmentation(frame.id, {make_instance(Role::kDynamic, {x_px, 70, 80, 100}, 0.9f)});
  filter.begin(frame, &seen, i > 0 ? std::optional<SE3>(SE3()) : std::nullopt);
  // As tracking does: only points outside what is excluded.
  std::vector<cv::Point2f> outside;
  for (const cv::Point2f& p : points)
    if (!is_masked(filter.excluded(), p)) outside.push_back(p);
  const std::vector<std::uint8_t> use = filter.judge(outside, depths_at(outside, frame.depth));
  filter.end(SE3(), {});
  return use;
}

TEST(DynamicFilter, APersonAtRestIsUsedAndGoesTheMomentSheMoves) {
  DynamicOptions options = with("masks", true);
  options.rest_after_s = 0.5;
  DynamicFilter filter(small_camera(), options);
  const auto masks_anything = [&] { return !filter.excluded().empty() && cv::countNonZero(filter.excluded()) > 0; };
  std::uint32_t i = 0;
  for (; i < 10; ++i) step_person(filter, i, 100);
  EXPECT_TRUE(masks_anything()) << "a third of a second is not long";
  for (; i < 30; ++i) step_person(filter, i, 100);
  EXPECT_FALSE(masks_anything());
  EXPECT_GT(filter.record()->count(FeatureVerdict::kStatic), 0);

  // She goes; one frame's motion of 8 px at 1.5 m is far above the noise.
  const std::vector<std::uint8_t> use = step_person(filter, i, 108);
  const auto record = filter.record();
  int on_her = 0, used_on_her = 0;
  for (std::size_t k = 0; k < use.size(); ++k) {
    if (!cv::Rect(108, 70, 80, 100).contains(record->features[k].pixel)) continue;
    ++on_her;
    used_on_her += use[k] != kNotUsed;
  }
  EXPECT_GT(on_her, 50) << "her features had been extracted";
  EXPECT_EQ(used_on_her, 0);
  step_person(filter, i + 1, 116);
  EXPECT_TRUE(masks_anything());
}

/// The board is a person whose mask lacks the arm that she holds out to the right.
RgbdFrame make_frame_with_arm(std::uint32_t id) {
  RgbdFrame frame = make_frame(id, 100);
  frame.depth(cv::Rect(180, 110, 80, 24)).setTo(1.5);
  return frame;
}

TEST(DynamicFilter, AnUntestedFeatureThatHangsOnAPersonFoundsNoLandmark) {
  DynamicFilter filter(small_camera(), with("masks", true));
  const RgbdFrame frame = make_frame_with_arm(0);
  const Segmentation person = make_segmentation(frame.id, {make_instance(Role::kDynamic, {100, 70, 80, 100}, 0.9f)});
  filter.begin(frame, &person, std::nullopt);
  const std::vector<cv::Point2f> points{{230, 122}, {230, 108}, {230, 160}};  // arm, its outline, the wall below it
  const std::vector<std::uint8_t> use = filter.judge(points, depths_at(points, frame.depth));
  EXPECT_EQ(use, (std::vector<std::uint8_t>{kKnownLandmarkOnly, kKnownLandmarkOnly, kFullyUsed}));
  filter.end(SE3(), {});
  EXPECT_EQ(filter.record()->features[0].reason, FeatureReason::kNearMoving);
  EXPECT_EQ(filter.record()->features[0].use, kKnownLandmarkOnly);
  EXPECT_EQ(filter.record()->features[2].reason, FeatureReason::kNoEvidence);
}

TEST(DynamicFilter, ALimbThatIsSeenToRestFoundsNoLandmarkNearTheBody) {
  DynamicFilter filter(small_camera(), with("masks", true));
  const std::vector<cv::Point2f> points{{196, 122}, {250, 122}, {196, 160}};  // upper arm, hand, wall below
  std::vector<std::uint8_t> use;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const RgbdFrame frame = make_frame_with_arm(i);
    const Segmentation person = make_segmentation(frame.id, {make_instance(Role::kDynamic, {100, 70, 80, 100}, 0.9f)});
    filter.begin(frame, &person, SE3());
    std::vector<cv::Point2f> seen = raster();
    seen.insert(seen.begin(), points.begin(), points.end());
    use = filter.judge(seen, depths_at(seen, frame.depth));
    filter.end(SE3(), {});
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    ASSERT_EQ(filter.record()->features[i].verdict, FeatureVerdict::kStatic) << i;
  EXPECT_EQ(use[0], kKnownLandmarkOnly);
  EXPECT_EQ(use[1], kFullyUsed) << "farther along the arm than dynamic.rest_reach_m";
  EXPECT_EQ(use[2], kFullyUsed);
}

TEST(DynamicFilter, WithTooFewFeaturesLeftMotionIsDoubtedFirst) {
  DynamicOptions options = with("off", true);
  options.least_features = 100000;
  DynamicFilter filter(small_camera(), options);
  const auto record = move_board(filter, 4, false);
  EXPECT_EQ(record->fail_open, FailOpen::kMotion);
  EXPECT_GT(record->count(FeatureVerdict::kMoving), 0) << "the verdicts are recorded all the same";
}

TEST(DynamicFilter, FramesWithoutDepthOrFeaturesAreFine) {
  DynamicFilter filter(small_camera(), with("masks", true));
  for (std::uint32_t i = 0; i < 4; ++i) {
    RgbdFrame frame = make_frame(i, 100);
    frame.depth = cv::Mat();
    filter.begin(frame, nullptr, std::nullopt);
    EXPECT_TRUE(filter.judge({}, {}).empty());
    filter.end(std::nullopt, {});
    EXPECT_EQ(filter.record()->fail_open, FailOpen::kNo);
  }
}

}  // namespace
}  // namespace semvslam
