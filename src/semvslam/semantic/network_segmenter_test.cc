#include "semvslam/semantic/network_segmenter.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "semvslam/base/temporary_folder_test_support.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const fs::path kModels = fs::path(SEMVSLAM_SOURCE_DIR) / "models";

SegmentationRequest request(cv::Mat image) { return {FrameId(0), TimeStamp{}, std::move(image), ""}; }

/// Graphs without a network: features, scores and boxes are what a test sets.
class FakeGraphs final : public NetworkGraphs, public MaskGraphs {
 public:
  explicit FakeGraphs(const ModelDescription& model) : classes_(model.classes.size()) {
    for (std::size_t l = 0; l < level_.size(); ++l) {
      const int rows = model.input.height / model.strides[l], columns = model.input.width / model.strides[l];
      const auto cells = static_cast<std::size_t>(rows) * columns;
      level_[l].features.assign(cells * model.channels, 0.f);
      level_[l].objectness.assign(cells * model.anchors_per_cell(), -5.f);
      level_[l].deltas.assign(cells * model.anchors_per_cell() * 4, 0.f);
      out_.levels[l] = {
          {level_[l].features.data(), rows, columns, model.strides[l]}, level_[l].objectness, level_[l].deltas};
    }
    semantic_.assign(static_cast<std::size_t>(model.input.area()) / 64 * TrunkOutput::kSemanticChannels, 1.f);
    out_.semantic = semantic_;
    box_in_.resize(static_cast<std::size_t>(kBoxBatch) * kBoxCells * kBoxCells * model.channels);
    mask_in_.resize(static_cast<std::size_t>(kMaskCells) * kMaskCells * model.channels);
    probabilities_.assign(kBoxBatch * (classes_ + 1), 0.f);
    deltas_.assign(kBoxBatch * 4, 0.f);
    masks_.assign(static_cast<std::size_t>(kMaskChannels) * kMaskSide * kMaskSide, 1.f);
    if (model.refine.empty()) return;
    const int rows = model.input.height / model.fine_stride, columns = model.input.width / model.fine_stride;
    fine_.assign(static_cast<std::size_t>(rows) * columns * model.fine_channels, 0.5f);
    out_.fine = {fine_.data(), rows, columns, model.fine_stride};
    logits_in_.resize(static_cast<std::size_t>(model.refine_side) * model.refine_side);
    fine_in_.resize(logits_in_.size() * model.fine_channels);
    refined_.assign(logits_in_.size(), 1.f);
  }
  Result<TrunkOutput> trunk(const cv::Mat&) override { return out_; }
  std::span<float> box_input() override { return box_in_; }
  Result<BoxHeadOutput> box_head() override { return BoxHeadOutput{probabilities_, deltas_}; }
  std::span<MaskGraphs* const> mask_graphs() override { return mask_graphs_; }
  std::span<float> mask_input() override { return mask_in_; }
  Result<std::span<const float>> mask_head() override { return std::span<const float>(masks_); }
  RefineInput refine_input() override { return {logits_in_, fine_in_}; }
  Result<std::span<const float>> refine_head() override { return std::span<const float>(refined_); }
  std::string description() const override { return "fake"; }

  struct Level {
    std::vector<float> features, objectness, deltas;
  };
  std::array<Level, 3> level_;
  std::vector<float> probabilities_, deltas_, masks_, semantic_, fine_, refined_;
  std::vector<float> logits_in_, fine_in_;  // what the refinement was given last

 private:
  std::size_t classes_;
  TrunkOutput out_;
  std::vector<float> box_in_, mask_in_;
  const std::array<MaskGraphs*, 1> mask_graphs_{this};
};

ModelDescription small_model() {
  ModelDescription m;
  m.name = "test";
  m.input = {128, 96};
  m.classes = {"person", "cup"};
  m.strides = {8, 16, 32};
  m.anchor_sizes = {std::vector<float>{16}, {32}, {64}};
  m.anchor_ratios = {1};
  m.box_weights = {10, 10, 5, 5};
  m.box_levels = {28, 84};
  m.mask_levels = {56};
  m.channels = 4;
  return m;
}

ModelDescription refining_model() {
  ModelDescription m = small_model();
  m.refine = "refine.onnx";
  m.fine_stride = 4;
  m.fine_channels = 2;
  m.refine_margin = 0.25f;
  return m;
}

struct Fake {
  explicit Fake(const ModelDescription& model = small_model()) {
    auto owned = std::make_unique<FakeGraphs>(model);
    graphs = owned.get();
    segmenter =
        std::make_unique<NetworkSegmenter>(std::move(owned), model, NetworkSegmenter::Limits{}, RoleTable(), nullptr);
  }
  FakeGraphs* graphs;
  std::unique_ptr<NetworkSegmenter> segmenter;
};

TEST(NetworkSegmenter, AnAnchorThatIsSureBecomesAnInstanceInImagePixels) {
  Fake f;
  f.graphs->level_[2].objectness[5] = 9.f;  // cell (1, 1) of 3 x 4: a 64 px square around (48, 48)
  f.graphs->probabilities_[1] = 0.8f;
  const Result<Segmentation> s = f.segmenter->segment(request(cv::Mat(192, 256, CV_8UC3, cv::Scalar::all(0))));
  ASSERT_TRUE(s) << s.error().message;
  ASSERT_EQ(s->instances.size(), 1u);
  const Instance& i = s->instances[0];
  EXPECT_EQ(i.class_name, "person");
  EXPECT_EQ(i.role, Role::kDynamic);
  EXPECT_LT(i.score, 0.8f);  // mask and semantic map are sure of all of it, but for the mask's fading edge
  EXPECT_GT(i.score, 0.96f * 0.8f);
  EXPECT_EQ(i.box, cv::Rect2f(32, 32, 128, 128));
  EXPECT_EQ(i.window, cv::Rect(32, 32, 128, 128));
}

TEST(NetworkSegmenter, ARefinementSeesMoreThanTheBoxAndItsMaskIsWhatIsPasted) {
  Fake f(refining_model());
  f.graphs->level_[2].objectness[5] = 9.f;  // a 64 px square around (48, 48): with its margin from 0 to 96
  f.graphs->probabilities_[1] = 0.8f;
  f.graphs->semantic_.assign(f.graphs->semantic_.size(), 0.f);
  constexpr int kSide = ModelDescription::kRefineSide;
  for (int y = 0; y < kSide; ++y)
    for (int x = kSide / 2; x < kSide; ++x) f.graphs->refined_[static_cast<std::size_t>(y * kSide + x)] = 0.f;
  const Result<Segmentation> s = f.segmenter->segment(request(cv::Mat(192, 256, CV_8UC3, cv::Scalar::all(0))));
  ASSERT_TRUE(s) << s.error().message;
  ASSERT_EQ(s->instances.size(), 1u);
  EXPECT_EQ(s->instances[0].box, cv::Rect2f(32, 32, 128, 128));  // the object's, not the refinement's
  const cv::Rect inside = cv::boundingRect(s->instances[0].mask) + s->instances[0].window.tl();
  EXPECT_NEAR(inside.x, 0, 3);
  EXPECT_NEAR(inside.br().x, 96, 3);
  EXPECT_NEAR(inside.y, 0, 3);
  EXPECT_NEAR(inside.br().y, 192, 3);
  // The box begins and ends at a sixth of the region.
  const auto logit = [&](int y, int x) { return f.graphs->logits_in_[static_cast<std::size_t>(y * kSide + x)]; };
  EXPECT_GT(logit(kSide / 2, kSide / 2), 0.f);
  EXPECT_GT(logit(kSide / 2, kSide / 6 + 2), 0.f);
  EXPECT_LT(logit(kSide / 2, kSide / 6 - 2), 0.f);
  EXPECT_LT(logit(kSide - 1, kSide / 2), 0.f);
  EXPECT_THAT(f.graphs->fine_in_, ::testing::Each(::testing::FloatNear(0.5f, 1e-5f)));
}

TEST(NetworkSegmenter, NumbersThatAreNotFiniteAreAnError) {
  const cv::Mat image(96, 128, CV_8UC3, cv::Scalar::all(0));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Fake a, b, c, d(refining_model());
  a.graphs->level_[0].objectness[3] = nan;
  b.graphs->level_[1].objectness[3] = 9;
  b.graphs->probabilities_[2] = nan;
  c.graphs->level_[1].objectness[3] = 9;
  c.graphs->probabilities_[1] = 0.9f;
  c.graphs->masks_[0] = nan;
  d.graphs->level_[1].objectness[3] = 9;
  d.graphs->probabilities_[1] = 0.9f;
  d.graphs->refined_[7] = nan;
  for (Fake* f : {&a, &b, &c, &d}) {
    const Result<Segmentation> s = f->segmenter->segment(request(image));
    ASSERT_FALSE(s);
    EXPECT_THAT(s.error().message, HasSubstr("not finite"));
  }
}

TEST(NetworkSegmenter, NothingSureMeansNoInstance) {
  Fake f;
  const Result<Segmentation> s = f.segmenter->segment(request(cv::Mat(96, 128, CV_8UC3, cv::Scalar::all(0))));
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->instances.empty());
  EXPECT_FALSE(f.segmenter->segment(request(cv::Mat())));
}

TEST(ModelDescription, AMissingOrDamagedModelNamesTheFile) {
  const auto absent = ModelDescription::read("/nonexistent");
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().message, HasSubstr("model.json"));
  const testing_support::TemporaryFolder folder;
  for (const char* text : {"", "{", "[]", "{\"format\": 2}", "{\"format\": 1, \"name\": 5}"}) {
    std::ofstream(folder / "model.json") << text;
    const auto damaged = ModelDescription::read(folder.path());
    ASSERT_FALSE(damaged) << text;
    EXPECT_THAT(damaged.error().message, HasSubstr("model.json"));
  }
}

TEST(ModelDescription, ARefinementThatIsNotDescribedIsAnError) {
  std::ifstream file(kModels / "model.json");
  const nlohmann::json shipped = nlohmann::json::parse(file);
  ASSERT_TRUE(ModelDescription::parse(shipped.dump(), "m"));
  const auto fault = [&](auto change) {
    nlohmann::json j = shipped;
    change(j);
    const auto parsed = ModelDescription::parse(j.dump(), "m");
    return parsed ? std::string() : parsed.error().message;
  };
  EXPECT_THAT(fault([](auto& j) { j.erase("fine_channels"); }), HasSubstr("fine_channels"));
  EXPECT_THAT(fault([](auto& j) { j["fine_stride"] = 0; }), HasSubstr("fine_stride"));
  EXPECT_THAT(fault([](auto& j) { j["fine_stride"] = 7; }), HasSubstr("fine_stride"));
  EXPECT_THAT(fault([](auto& j) { j["refine_margin"] = -1; }), HasSubstr("refine_margin"));
  EXPECT_EQ(fault([](auto& j) { j.erase("refine"), j.erase("fine_stride"); }), "");  // a model may do without
}

TEST(ModelDescription, TheShippedNetworkSaysWhatItCosts) {
  const auto model = ModelDescription::read(kModels);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_NEAR(model->gflops.of_image(NetworkGraphs::kBoxBatch, 5), 7.37, 0.01);  // training/table2.py
}

TEST(ModelDescription, AnotherWidthKeepsTheShapeOfTheInput) {
  Result<ModelDescription> model = ModelDescription::read(kModels);
  ASSERT_TRUE(model) << model.error().message;
  const double gflops = model->gflops.trunk;
  ASSERT_EQ(model->input, cv::Size(640, 480));
  model->set_input_width(512);
  EXPECT_EQ(model->input, cv::Size(512, 384));
  EXPECT_NEAR(model->gflops.trunk, 0.64 * gflops, 1e-9);
  EXPECT_EQ(model->refine_side, 48);
  model->set_input_width(570);  // sides are multiples of 32
  EXPECT_EQ(model->input, cv::Size(576, 448));
  model->set_input_width(1);
  EXPECT_EQ(model->input, cv::Size(32, 32));
}

/// The shipped network; these need OpenVINO.
class ShippedNetwork : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!have_openvino()) GTEST_SKIP() << "built without OpenVINO";
  }
  static Result<std::unique_ptr<Segmenter>> make(int threads = 1, double score = 0.05) {
    SegmenterOptions options;
    options.model = kModels.string();
    options.backend = "openvino";
    options.precision = "f32";
    options.threads = threads;
    options.score = score;
    return make_segmenter(options, RoleTable());
  }
};

TEST_F(ShippedNetwork, FindsWhatTheReferenceFinds) {
  auto segmenter = make();
  ASSERT_TRUE(segmenter) << segmenter.error().message;
  std::ifstream file(kModels / "golden" / "golden.json");
  const nlohmann::json wanted = nlohmann::json::parse(file).at("detections");
  const cv::Mat picture = cv::imread((kModels / "golden" / "people.jpg").string());
  ASSERT_FALSE(picture.empty());
  const Result<Segmentation> s = (*segmenter)->segment(request(picture));
  ASSERT_TRUE(s) << s.error().message;
  // Weak objects may swap places or cross the threshold by rounding; sure ones must agree.
  for (const nlohmann::json& w : wanted) {
    if (w.at("score").get<float>() < 0.3f) continue;
    const auto same = [&](const Instance& i) {
      return i.class_name == w.at("class").get<std::string>() &&
             std::abs(i.score - w.at("score").get<float>()) < 0.02f &&
             std::abs(i.box.x - w.at("box")[0].get<float>()) < 2 &&
             std::abs(i.box.br().y - w.at("box")[3].get<float>()) < 2 &&
             std::abs(cv::countNonZero(i.mask) - w.at("mask_pixels").get<int>()) <
                 0.02 * w.at("mask_pixels").get<int>() + 20;
    };
    EXPECT_TRUE(std::any_of(s->instances.begin(), s->instances.end(), same)) << w.dump();
  }
}

TEST_F(ShippedNetwork, TheNumberOfThreadsDoesNotChangeTheResult) {
  const cv::Mat picture = cv::imread((kModels / "golden" / "people.jpg").string());
  auto one = make(1);
  ASSERT_TRUE(one);
  const auto a = (*one)->segment(request(picture));
  ASSERT_TRUE(a);
  EXPECT_GE(a->instances.size(), 2u);  // enough to differ in
  for (const int threads : {0, 2, 3, 8}) {
    auto more = make(threads);
    ASSERT_TRUE(more);
    const auto b = (*more)->segment(request(picture));
    ASSERT_TRUE(b);
    ASSERT_EQ(a->instances.size(), b->instances.size()) << threads;
    for (std::size_t i = 0; i < a->instances.size(); ++i) {
      EXPECT_EQ(a->instances[i].score, b->instances[i].score);
      EXPECT_EQ(a->instances[i].box, b->instances[i].box);
      EXPECT_EQ(a->instances[i].window, b->instances[i].window);
      EXPECT_EQ(cv::norm(a->instances[i].mask, b->instances[i].mask, cv::NORM_INF), 0);
    }
  }
}

TEST_F(ShippedNetwork, OpenCvFindsTheSame) {
  constexpr double kScore = 0.5;
  SegmenterOptions options;
  options.model = kModels.string();
  options.backend = "opencv";
  options.score = kScore;
  auto by_opencv = make_segmenter(options, RoleTable());
  auto by_openvino = make(1, kScore);
  ASSERT_TRUE(by_opencv) << by_opencv.error().message;
  ASSERT_TRUE(by_openvino);
  const cv::Mat picture = cv::imread((kModels / "golden" / "people.jpg").string());
  const auto a = (*by_opencv)->segment(request(picture)), b = (*by_openvino)->segment(request(picture));
  ASSERT_TRUE(a) << a.error().message;
  ASSERT_TRUE(b);
  const cv::Mat persons_a = a->mask_of_class("person"), persons_b = b->mask_of_class("person");
  EXPECT_GT(cv::countNonZero(persons_b), 1000);
  EXPECT_LT(cv::countNonZero(persons_a != persons_b), 0.01 * cv::countNonZero(persons_b));
}

TEST_F(ShippedNetwork, PersonsAreFoundAtOtherWidthsAndInEightBits) {
  const cv::Mat picture = cv::imread((kModels / "golden" / "people.jpg").string());
  SegmenterOptions options;
  options.model = kModels.string();
  options.backend = "openvino";
  options.precision = "f32";
  const auto persons = [&] {
    const auto segmenter = make_segmenter(options, RoleTable());
    if (!segmenter) throw std::runtime_error(segmenter.error().message);
    const auto s = (*segmenter)->segment(request(picture));
    if (!s) throw std::runtime_error(s.error().message);
    return s->mask_of_class("person");
  };
  const auto overlap = [](const cv::Mat& a, const cv::Mat& b) {
    return static_cast<double>(cv::countNonZero(a & b)) / cv::countNonZero(a | b);
  };
  const cv::Mat reference = persons();
  ASSERT_GT(cv::countNonZero(reference), 1000);
  options.input_width_px = 512;
  EXPECT_GT(overlap(persons(), reference), 0.7);  // a hand, a sleeve make the difference
  options.input_width_px = 768;
  EXPECT_GT(overlap(persons(), reference), 0.7);
  options.input_width_px = 0;
  options.precision = "int8";
  EXPECT_GT(overlap(persons(), reference), 0.9);
  options.backend = "opencv";
  const auto refused = make_segmenter(options, RoleTable());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnsupported);
}

TEST_F(ShippedNetwork, WhereNoCameraWaitsAPictureIsSeenWiderAndInFloats) {
  SegmenterOptions options;
  options.model = kModels.string();
  options.backend = "openvino";
  const auto input_of = [&](const char* precision, bool keep_up) {
    options.precision = precision;
    options.keep_up = keep_up;
    const auto segmenter = make_segmenter(options, RoleTable());
    return segmenter ? (*segmenter)->description() : segmenter.error().message;
  };
  EXPECT_THAT(input_of("f32", true), HasSubstr("640x480"));
  EXPECT_THAT(input_of("f32", false), HasSubstr("768x576"));
  EXPECT_THAT(input_of("auto", false), HasSubstr("trunk.onnx, 768x576"));
  EXPECT_THAT(input_of("int8", false), HasSubstr("640x480"));
}

TEST_F(ShippedNetwork, BesideACameraTheProcessorDecidesWhichTrunkAndHowWide) {
  SegmenterOptions options;
  options.model = kModels.string();
  options.backend = "openvino";
  const auto segmenter = make_segmenter(options, RoleTable());
  ASSERT_TRUE(segmenter) << segmenter.error().message;
  const std::string chosen = (*segmenter)->description();
  switch (fast_numbers()) {
    case FastNumbers::kShortFloats:
      EXPECT_THAT(chosen, HasSubstr("trunk.onnx, 640x480"));
      break;
    case FastNumbers::kEightBits:
      EXPECT_THAT(chosen, HasSubstr("trunk.int8.xml, 512x384"));
      break;
    case FastNumbers::kNone:
      EXPECT_THAT(chosen, HasSubstr("trunk.int8.xml, 416x320"));
      break;
  }
}

TEST_F(ShippedNetwork, ACheaperBoxHeadFindsTheSamePersons) {
  const Result<ModelDescription> model = ModelDescription::read(kModels);
  ASSERT_TRUE(model) << model.error().message;
  const cv::Mat picture = cv::imread((kModels / "golden" / "people.jpg").string());
  const auto persons = [&](double energy) {
    auto graphs = make_openvino_graphs(kModels, *model, {"f32", 1, energy});
    if (!graphs) throw std::runtime_error(graphs.error().message);
    NetworkSegmenter segmenter(std::move(*graphs), *model, {}, RoleTable(), nullptr);
    const auto s = segmenter.segment(request(picture));
    if (!s) throw std::runtime_error(s.error().message);
    return std::pair(s->mask_of_class("person"), s->instances.at(0).score);
  };
  const auto [whole, score] = persons(1);
  const auto [cheap, score_of_cheap] = persons(0.88);
  EXPECT_NE(score, score_of_cheap);  // it is another head
  EXPECT_NEAR(score, score_of_cheap, 0.05);
  EXPECT_GT(cv::countNonZero(whole & cheap), 0.95 * cv::countNonZero(whole | cheap));
}

TEST_F(ShippedNetwork, EightBitsThatTheModelLacksAreAnError) {
  Result<ModelDescription> model = ModelDescription::read(kModels);
  ASSERT_TRUE(model);
  model->trunk_int8.clear();
  const auto graphs = make_openvino_graphs(kModels, *model, {"int8"});
  ASSERT_FALSE(graphs);
  EXPECT_EQ(graphs.error().code, ErrorCode::kInvalidInput);
  EXPECT_THAT(graphs.error().message, HasSubstr("trunk_int8"));
}

TEST_F(ShippedNetwork, AWrongGraphIsNamed) {
  Result<ModelDescription> model = ModelDescription::read(kModels);
  ASSERT_TRUE(model);
  ModelDescription swapped = *model;
  std::swap(swapped.box, swapped.mask);
  auto graphs = make_openvino_graphs(kModels, swapped, {"f32"});
  ASSERT_FALSE(graphs);
  EXPECT_THAT(graphs.error().message, HasSubstr("'rois'"));
  ModelDescription fewer = *model;
  fewer.classes.pop_back();
  graphs = make_openvino_graphs(kModels, fewer, {"f32"});
  ASSERT_FALSE(graphs);
  EXPECT_THAT(graphs.error().message, HasSubstr("'probabilities'"));
  ModelDescription wider = *model;
  ++wider.fine_channels;
  graphs = make_openvino_graphs(kModels, wider, {"f32"});
  ASSERT_FALSE(graphs);
  EXPECT_THAT(graphs.error().message, HasSubstr("'fine'"));
  swapped = *model;
  swapped.refine = swapped.box;
  graphs = make_openvino_graphs(kModels, swapped, {"f32"});
  ASSERT_FALSE(graphs);
  EXPECT_THAT(graphs.error().message, HasSubstr("'logits'"));
}

}  // namespace
}  // namespace semvslam
