// The steps after the network against training/infer.py's numbers (models/golden/golden.json), and Segmentation itself.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "semvslam/semantic/image_input.h"
#include "semvslam/semantic/mask_paste.h"
#include "semvslam/semantic/roi_align.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {
namespace {

nlohmann::json formulas() {
  std::ifstream file(std::string(SEMVSLAM_SOURCE_DIR) + "/models/golden/golden.json");
  return nlohmann::json::parse(file).at("formulas");
}

DetectionBox box_of(const nlohmann::json& j) { return {j[0], j[1], j[2], j[3]}; }

/// The feature map that golden.json describes.
std::vector<float> formula_map(int rows, int columns, int channels) {
  std::vector<float> out;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x)
      for (int c = 0; c < channels; ++c)
        out.push_back(static_cast<float>((37 * y + 17 * x + 11 * c) % 101) / 50.f - 1.f);
  return out;
}

std::vector<float> formula_mask() {
  std::vector<float> out;
  for (int y = 0; y < 28; ++y)
    for (int x = 0; x < 28; ++x) out.push_back(static_cast<float>((13 * y + 7 * x) % 29) / 28.f);
  return out;
}

std::vector<float> formula_hint() {
  std::vector<float> out;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) out.push_back(static_cast<float>((5 * y + 3 * x) % 17) / 16.f);
  return out;
}

TEST(SegmentationSteps, RoiAlignGivesTheReferencesNumbers) {
  const nlohmann::json wanted = formulas().at("roi_align");
  const std::vector<float> maps[] = {formula_map(48, 64, 4), formula_map(24, 32, 4), formula_map(12, 16, 4)};
  const FeatureMap levels[] = {{maps[0].data(), 48, 64, 8}, {maps[1].data(), 24, 32, 16}, {maps[2].data(), 12, 16, 32}};
  const float box_levels[] = {112, 336}, mask_levels[] = {224};
  for (std::size_t n = 0; n < wanted.at("boxes").size(); ++n) {
    const DetectionBox box = box_of(wanted.at("boxes")[n]);
    std::vector<float> seven(7 * 7 * 4), fourteen(14 * 14 * 4);
    roi_align(levels[roi_level(box, box_levels)], 4, box, 7, seven.data());
    roi_align(levels[roi_level(box, mask_levels)], 4, box, 14, fourteen.data());
    for (std::size_t i = 0; i < seven.size(); ++i)
      ASSERT_NEAR(seven[i], wanted.at("cells7")[n][i].get<float>(), 2e-4) << n << " " << i;
    for (std::size_t c = 0; c < 4; ++c) {
      float sum = 0;
      for (std::size_t i = c; i < fourteen.size(); i += 4) sum += fourteen[i];
      EXPECT_NEAR(sum, wanted.at("cells14_sum")[n][c].get<float>(), 2e-2) << n;
    }
  }
}

TEST(SegmentationSteps, PastingGivesTheReferencesPixels) {
  const nlohmann::json wanted = formulas().at("paste");
  const std::vector<float> probabilities = formula_mask();
  const PastedMask pasted =
      paste_mask({probabilities.data(), 28, box_of(wanted.at("box"))}, {wanted.at("width"), wanted.at("height")});
  EXPECT_EQ(pasted.window, cv::Rect(wanted.at("x0"), wanted.at("y0"), wanted.at("w"), wanted.at("h")));
  int differing = 0;
  for (int y = 0; y < pasted.mask.rows; ++y)
    differing += std::abs(cv::countNonZero(pasted.mask.row(y)) - wanted.at("row_counts")[y].get<int>());
  EXPECT_LE(differing, 3);  // a value of 0.5 sharp may fall to either side

  const nlohmann::json mixed = wanted.at("mixed");
  const std::vector<float> semantic = formula_hint();
  const SemanticHint hint{semantic.data(), 48, 64, 1, 2.f / 8, 2.5f / 8, 0.5f};
  const PastedMask both = paste_mask({probabilities.data(), 28, box_of(wanted.at("box"))},
                                     {wanted.at("width"), wanted.at("height")}, 0.48f, &hint);
  EXPECT_NEAR(cv::countNonZero(both.mask), mixed.at("pixels").get<int>(), 3);
  EXPECT_NEAR(both.certainty, mixed.at("certainty").get<float>(), 2e-3);
}

TEST(SegmentationSteps, ARefinementGetsTheReferencesLogits) {
  const nlohmann::json wanted = formulas().at("refine");
  const std::vector<float> probabilities = formula_mask(), semantic = formula_hint();
  const SemanticHint hint{semantic.data(), 48, 64, 1, 1.f / 8, 1.f / 8, 0.35f};
  const DetectionBox box = box_of(wanted.at("box")), region = box.grown(1.f / 14);
  EXPECT_NEAR(region.x0, wanted.at("region")[0].get<float>(), 1e-3);
  EXPECT_NEAR(region.y1, wanted.at("region")[3].get<float>(), 1e-3);
  std::vector<float> sampled(56 * 56);
  sample_mask({probabilities.data(), 28, box}, region, 56, &hint, sampled.data());
  EXPECT_NEAR(mean_inside(sampled, 0.44f), wanted.at("certainty").get<float>(), 1e-3);
  bend_logits(sampled, 0.44f);
  const nlohmann::json& rows = wanted.at("logits_of_every_5th_row");
  ASSERT_EQ(rows.size(), 12u);
  for (std::size_t y = 0; y < rows.size(); ++y)
    for (std::size_t x = 0; x < rows[y].size(); ++x)
      EXPECT_NEAR(sampled[y * 5 * 56 + x * 5], rows[y][x].get<float>(), 2e-3) << y << " " << x;
}

TEST(SegmentationSteps, SuppressionAndDecodingAgreeWithTheReference) {
  const nlohmann::json nms = formulas().at("nms"), decode = formulas().at("decode");
  std::vector<DetectionBox> boxes;
  for (const auto& b : nms.at("boxes")) boxes.push_back(box_of(b));
  EXPECT_EQ(suppress_overlaps(boxes, nms.at("scores").get<std::vector<float>>(), nms.at("threshold"), 50),
            nms.at("keep").get<std::vector<int>>());
  for (std::size_t i = 0; i < decode.at("boxes").size(); ++i) {
    const auto deltas = decode.at("deltas")[i].get<std::vector<float>>();
    const DetectionBox box = decode_box(deltas.data(), box_of(decode.at("reference")[i]), {1, 1, 1, 1},
                                        decode.at("width"), decode.at("height"));
    const DetectionBox wanted = box_of(decode.at("boxes")[i]);
    EXPECT_NEAR(box.x0, wanted.x0, 1e-2);
    EXPECT_NEAR(box.y1, wanted.y1, 1e-2);
  }
}

TEST(SegmentationSteps, AnEmptyBoxPastesNothing) {
  const std::vector<float> ones(28 * 28, 1.f);
  EXPECT_TRUE(paste_mask({ones.data(), 28, {10, 10, 10, 10}}, {100, 100}).window.empty());
  EXPECT_TRUE(paste_mask({ones.data(), 28, {100, 5, 100, 50}}, {100, 100}).window.empty());
}

TEST(SegmentationSteps, ImagesOfEveryUsualTypeAreAccepted) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3}) {
    const Result<cv::Mat> bgr = to_bgr8(cv::Mat(3, 5, type, cv::Scalar::all(200)));
    ASSERT_TRUE(bgr) << type;
    EXPECT_EQ(bgr->type(), CV_8UC3);
    EXPECT_EQ(bgr->size(), cv::Size(5, 3));
  }
  EXPECT_FALSE(to_bgr8(cv::Mat()));
  EXPECT_FALSE(to_bgr8(cv::Mat(3, 3, CV_32FC3)));
  EXPECT_FALSE(to_bgr8(cv::Mat(3, 3, CV_8UC2)));
}

TEST(SegmentationSteps, FittingKeepsTheShapeAndFillsTheRest) {
  cv::Mat memory;
  const FittedImage tall = fit_image(cv::Mat(480, 100, CV_8UC3, cv::Scalar::all(9)), {512, 384}, 127, memory);
  EXPECT_EQ(tall.image.size(), cv::Size(512, 384));
  EXPECT_FLOAT_EQ(tall.scale_x, 0.8f);
  EXPECT_EQ(tall.image.at<cv::Vec3b>(383, 79)[0], 9);
  EXPECT_EQ(tall.image.at<cv::Vec3b>(0, 80)[0], 127);
  EXPECT_NO_THROW(fit_image(cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(9)), {512, 384}, 127, memory));
  EXPECT_NO_THROW(fit_image(cv::Mat(1, 9000, CV_8UC3, cv::Scalar::all(9)), {512, 384}, 127, memory));
}

Segmentation two_objects() {
  Segmentation s;
  s.size = {20, 10};
  Instance person, cup;
  person.class_name = "person";
  person.role = Role::kDynamic;
  person.window = {2, 2, 6, 6};
  person.mask = cv::Mat(6, 6, CV_8UC1, cv::Scalar(255));
  cup.class_name = "cup";
  cup.role = Role::kMovable;
  cup.window = {6, 6, 4, 4};
  cup.mask = cv::Mat(4, 4, CV_8UC1, cv::Scalar(255));
  s.instances = {person, cup};
  return s;
}

TEST(Segmentation, MasksByRoleAndClass) {
  const Segmentation s = two_objects();
  EXPECT_EQ(cv::countNonZero(s.mask_of(Role::kDynamic)), 36);
  EXPECT_EQ(cv::countNonZero(s.mask_of(Role::kMovable)), 36 + 16 - 4);
  EXPECT_EQ(s.pixels_of_class("cup"), 16);
  EXPECT_EQ(s.pixels_of_class("dog"), 0);
}

TEST(Segmentation, WhereTwoOverlapTheBetterOneIsLabelled) {
  const cv::Mat labels = two_objects().labels();
  EXPECT_EQ(labels.at<std::uint16_t>(7, 7), 1);
  EXPECT_EQ(labels.at<std::uint16_t>(9, 9), 2);
  EXPECT_EQ(labels.at<std::uint16_t>(0, 0), 0);
}

TEST(Segmentation, EveryPixelHasTheClassOfTheBetterInstance) {
  Segmentation s = two_objects();
  s.instances[1].class_index = 21;
  s.instances.push_back(s.instances[1]);
  s.instances.back().window.x += 8;
  s.instances.push_back(s.instances[0]);
  s.instances.back().class_index = 19;  // hidden by the first
  const std::vector<ClassMask> classes = s.class_masks();
  ASSERT_EQ(classes.size(), 2u);
  EXPECT_EQ(classes[0].class_name, "person");
  EXPECT_EQ(cv::countNonZero(classes[0].pixels.mask()), 36);
  EXPECT_EQ(classes[1].class_name, "cup");
  EXPECT_EQ(classes[1].class_index, 21);
  EXPECT_EQ(cv::countNonZero(classes[1].pixels.mask()), 16 - 4 + 16);
  EXPECT_FALSE(classes[1].pixels.contains({7, 7}));
  EXPECT_TRUE(Segmentation().class_masks().empty());
}

}  // namespace
}  // namespace semvslam
