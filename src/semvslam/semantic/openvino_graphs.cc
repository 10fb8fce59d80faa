// The only file that knows OpenVINO.
#include "semvslam/semantic/network_graphs.h"

#ifdef SEMVSLAM_HAVE_OPENVINO
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <map>
#include <openvino/op/constant.hpp>
#include <openvino/op/matmul.hpp>
#include <openvino/openvino.hpp>

#include "semvslam/semantic/low_rank.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace semvslam {
namespace {

using Shape = std::vector<std::size_t>;

/// Says which tensor is wrong; thrown and caught in this file only, as OpenVINO's own exceptions are.
struct WrongTensor : std::runtime_error {
  using std::runtime_error::runtime_error;
};

ov::Core& core() {
  static ov::Core shared;  // its plugins stay loaded
  return shared;
}

/// What decides whether a processor's sixteen-bit floats and eight-bit products are fast.
struct Instructions {
  bool intel = false, amx = false, vnni = false;
};

Instructions instructions() {
  Instructions out;
#if defined(__x86_64__)
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid(0, &a, &b, &c, &d)) out.intel = b == signature_INTEL_ebx;
  if (__get_cpuid_count(7, 0, &a, &b, &c, &d)) {
    constexpr unsigned kAvx512Vnni = 1U << 11U, kAmxBf16 = 1U << 22U, kAvxVnni = 1U << 4U;
    out.vnni = (c & kAvx512Vnni) != 0;
    out.amx = (d & kAmxBf16) != 0;
    if (a >= 1 && __get_cpuid_count(7, 1, &a, &b, &c, &d)) out.vnni |= (a & kAvxVnni) != 0;
  }
#endif
  return out;
}

std::size_t count(const Shape& shape) {
  std::size_t n = 1;
  for (const std::size_t s : shape) n *= s;
  return n;
}

template <typename Action>
Status run(Action action) {
  try {
    action();
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInternal, fmt::format("OpenVINO: {}", e.what())};
  }
  return Status::success();
}

std::shared_ptr<ov::Model> read(const std::filesystem::path& file) { return core().read_model(file.string()); }

ov::CompiledModel compile(const std::shared_ptr<ov::Model>& m, const ov::AnyMap& options) {
  return core().compile_model(m, "CPU", options);
}

using Inputs = std::map<std::string, ov::PartialShape>;

void check_inputs(const std::shared_ptr<ov::Model>& m, const Inputs& wanted) {
  std::map<std::string, ov::PartialShape> own;
  for (const auto& i : m->inputs())
    for (const std::string& name : i.get_names()) own.emplace(name, i.get_partial_shape());
  std::vector<std::string> names;
  bool complete = m->inputs().size() == wanted.size();
  for (const auto& [name, shape] : wanted) {
    names.push_back(fmt::format("'{}'", name));
    complete &= own.contains(name);
  }
  if (!complete)
    throw WrongTensor(fmt::format("expected {} input{}, named {}", wanted.size(), wanted.size() == 1 ? "" : "s",
                                  fmt::join(names, ", ")));
  for (const auto& [name, shape] : wanted)
    if (!own.at(name).compatible(shape))
      throw WrongTensor(
          fmt::format("input '{}' has the shape {}, expected {}", name, own.at(name).to_string(), shape.to_string()));
}

/// Replaces the largest product with a constant matrix by two that together take half the operations or less, where
/// there are such: see factor(). The last products, of classes and boxes, are small, and every rank of theirs counts.
void shorten_largest_product(const std::shared_ptr<ov::Model>& m, double energy) {
  std::shared_ptr<ov::op::v0::MatMul> largest;
  std::shared_ptr<ov::op::v0::Constant> weights;
  for (const std::shared_ptr<ov::Node>& node : m->get_ordered_ops()) {
    const auto product = ov::as_type_ptr<ov::op::v0::MatMul>(node);
    if (!product || product->get_transpose_a() || !product->get_transpose_b()) continue;
    const auto right = ov::as_type_ptr<ov::op::v0::Constant>(product->get_input_node_shared_ptr(1));
    if (!right || right->get_element_type() != ov::element::f32 || right->get_shape().size() != 2) continue;
    if (weights && count(right->get_shape()) <= count(weights->get_shape())) continue;
    largest = product;
    weights = right;
  }
  if (!largest) return;
  const std::optional<LowRank> factors =
      factor(Eigen::Map<const RowMajorMatrix>(weights->get_data_ptr<float>(),
                                              static_cast<Eigen::Index>(weights->get_shape()[0]),
                                              static_cast<Eigen::Index>(weights->get_shape()[1])),
             energy);
  if (!factors) return;
  const auto times = [](const ov::Output<ov::Node>& left, const RowMajorMatrix& right) {
    const Shape shape{static_cast<std::size_t>(right.rows()), static_cast<std::size_t>(right.cols())};
    const auto constant = std::make_shared<ov::op::v0::Constant>(ov::element::f32, shape, right.data());
    return std::make_shared<ov::op::v0::MatMul>(left, constant, false, true);
  };
  ov::replace_node(largest, times(times(largest->input_value(0), factors->wide), factors->high));
}

/// @param change made to the graph before it is compiled; null = none.
ov::InferRequest load_graph(const std::filesystem::path& file, const Inputs& inputs, const ov::AnyMap& options,
                            const std::function<void(const std::shared_ptr<ov::Model>&)>& change = nullptr) {
  try {
    const std::shared_ptr<ov::Model> m = read(file);
    check_inputs(m, inputs);
    m->reshape(inputs);
    if (change) change(m);
    return compile(m, options).create_infer_request();
  } catch (const std::exception& e) {
    throw WrongTensor(fmt::format("{}: {}", file.string(), e.what()));
  }
}

std::span<float> input(ov::InferRequest& request, const std::string& name) {
  ov::Tensor t = request.get_tensor(name);
  return {t.data<float>(), t.get_size()};
}

ov::Tensor checked(ov::InferRequest& request, const std::string& file, const std::string& name,
                   const ov::element::Type& type, const Shape& wanted) {
  ov::Tensor t;
  try {
    t = request.get_tensor(name);
  } catch (const std::exception&) {
    throw WrongTensor(fmt::format("{}: there is no output '{}'", file, name));
  }
  if (t.get_element_type() != type || t.get_shape() != ov::Shape(wanted))
    throw WrongTensor(fmt::format("{}: output '{}' is {} {}, expected {} [{}]", file, name,
                                  t.get_element_type().to_string(), t.get_shape().to_string(), type.to_string(),
                                  fmt::join(wanted, ",")));
  return t;
}

/// Output memory does not move between calls: shapes are fixed.
std::span<const float> output(ov::InferRequest& request, const std::string& file, const std::string& name,
                              const Shape& wanted) {
  return {checked(request, file, name, ov::element::f32, wanted).data<float>(), count(wanted)};
}

class OpenVinoMaskGraphs final : public MaskGraphs {
 public:
  OpenVinoMaskGraphs(const std::filesystem::path& folder, const ModelDescription& model, const ov::AnyMap& options) {
    constexpr std::size_t kCells = NetworkGraphs::kMaskCells, kSide = NetworkGraphs::kMaskSide;
    mask_ = load_graph(folder / model.mask, {{"rois", {1, kCells, kCells, model.channels}}}, options);
    masks_ = output(mask_, model.mask, "masks", {1, NetworkGraphs::kMaskChannels, kSide, kSide});
    if (model.refine.empty()) return;
    const auto refined_inputs = [&](int side) {
      return Inputs{{"logits", {1, side, side}}, {"features", {1, side, side, model.fine_channels}}};
    };
    refine_ = load_graph(folder / model.refine, refined_inputs(ModelDescription::kRefineSide), options,
                         [&](const auto& m) { m->reshape(refined_inputs(model.refine_side)); });
    const auto side = static_cast<std::size_t>(model.refine_side);
    refined_ = output(refine_, model.refine, "masks", {1, side, side});
    refine_in_ = {input(refine_, "logits"), input(refine_, "features")};
  }

  std::span<float> mask_input() override { return input(mask_, "rois"); }
  RefineInput refine_input() override { return refine_in_; }

  Result<std::span<const float>> mask_head() override {
    if (Status s = run([&] { mask_.infer(); }); !s) return s.error();
    return masks_;
  }

  Result<std::span<const float>> refine_head() override {
    if (Status s = run([&] { refine_.infer(); }); !s) return s.error();
    return refined_;
  }

 private:
  ov::InferRequest mask_, refine_;
  std::span<const float> masks_, refined_;
  RefineInput refine_in_;
};

class OpenVinoGraphs final : public NetworkGraphs {
 public:
  OpenVinoGraphs(const std::filesystem::path& folder, const ModelDescription& model, const GraphOptions& wanted)
      : model_(model) {
    const std::string& precision = wanted.precision;
    ov::AnyMap options{ov::num_streams(1), ov::inference_num_threads(wanted.threads),
                       ov::hint::enable_cpu_pinning(false)};
    // OpenVINO would take bfloat16 wherever it exists, also where it is slower.
    if (precision == "f32" || fast_numbers() != FastNumbers::kShortFloats)
      options.insert(ov::hint::inference_precision(ov::element::f32));
    if (precision == "int8" && model.trunk_int8.empty())
      throw WrongTensor(
          fmt::format("{}: has no eight-bit trunk ('trunk_int8' in model.json); take precision auto or "
                      "f32, or export it with --int8",
                      folder.string()));
    trunk_name_ = precision == "int8" ? model.trunk_int8 : model.trunk;
    const bool floats = options.count(ov::hint::inference_precision.name()) > 0 || precision == "int8";
    short_features_ = !floats && core().get_property("CPU", ov::hint::inference_precision) == ov::element::bf16;
    load_trunk(folder / trunk_name_, options);
    // The heads' matrix products sum in another order with another number of threads; a trunk's convolutions do not.
    options[ov::inference_num_threads.name()] = 1;
    const ov::Dimension c = model.channels;
    box_ = load_graph(folder / model.box, {{"rois", {kBoxBatch, kBoxCells, kBoxCells, model.channels}}}, options,
                      [&](const auto& m) {
                        if (wanted.box_energy < 1) shorten_largest_product(m, wanted.box_energy);
                      });
    probabilities_ = output(box_, model.box, "probabilities", {kBoxBatch, model.classes.size() + 1});
    box_deltas_ = output(box_, model.box, "deltas", {kBoxBatch, 4});
    for (int lane = 0; lane < std::min(wanted.threads, kMaskLanes); ++lane) {
      owned_masks_.push_back(std::make_unique<OpenVinoMaskGraphs>(folder, model, options));
      masks_.push_back(owned_masks_.back().get());
    }
  }

  Result<TrunkOutput> trunk(const cv::Mat& image) override {
    if (image.type() != CV_8UC3 || image.size() != model_.input || !image.isContinuous())
      return Error{ErrorCode::kInternal, "the trunk got an image of a wrong size or type"};
    if (Status s = run([&] {
          trunk_.set_input_tensor(ov::Tensor(
              ov::element::u8, {1, static_cast<std::size_t>(image.rows), static_cast<std::size_t>(image.cols), 3},
              image.data));
          trunk_.infer();
        });
        !s)
      return s.error();
    for (ShortOutput& o : short_outputs_) o.widen();
    return trunk_out_;
  }

  std::span<float> box_input() override { return input(box_, "rois"); }
  std::span<MaskGraphs* const> mask_graphs() override { return masks_; }

  Result<BoxHeadOutput> box_head() override {
    if (Status s = run([&] { box_.infer(); }); !s) return s.error();
    return BoxHeadOutput{probabilities_, box_deltas_};
  }

  std::string description() const override {
    return fmt::format("{} ({}, {}x{}) by OpenVINO {}", model_.name, trunk_name_, model_.input.width,
                       model_.input.height, ov::get_openvino_version().buildNumber);
  }

 private:
  static constexpr int kMaskLanes = 2;  // more would seldom have a third person to work on

  void load_trunk(const std::filesystem::path& file, const ov::AnyMap& options) {
    try {
      const std::shared_ptr<ov::Model> m = read(file);
      const auto h = static_cast<std::size_t>(model_.input.height), w = static_cast<std::size_t>(model_.input.width);
      check_inputs(m, {{"image", {1, 3, ov::Dimension::dynamic(), ov::Dimension::dynamic()}}});
      m->reshape(ov::PartialShape(ov::Shape{1, 3, h, w}));
      ov::preprocess::PrePostProcessor p(m);
      p.input()
          .tensor()
          .set_element_type(ov::element::u8)
          .set_layout("NHWC")
          .set_color_format(ov::preprocess::ColorFormat::BGR);
      p.input()
          .preprocess()
          .convert_element_type(ov::element::f32)
          .convert_color(ov::preprocess::ColorFormat::RGB)
          .mean(127.5f)
          .scale(127.5f);
      p.input().model().set_layout("NCHW");
      if (short_features_)
        for (const ov::Output<ov::Node>& o : m->outputs())
          if (is_feature(o.get_any_name())) p.output(o.get_any_name()).tensor().set_element_type(ov::element::bf16);
      trunk_ = compile(p.build(), options).create_infer_request();
    } catch (const std::exception& e) {
      throw WrongTensor(fmt::format("{}: {}", file.string(), e.what()));
    }
    const auto a = static_cast<std::size_t>(model_.anchors_per_cell());
    for (std::size_t l = 0; l < trunk_out_.levels.size(); ++l) {
      const int stride = model_.strides[l], rows = model_.input.height / stride, columns = model_.input.width / stride;
      const auto r = static_cast<std::size_t>(rows), c = static_cast<std::size_t>(columns);
      const auto part = [&](const char* name, std::size_t channels) {
        return output(trunk_, trunk_name_, fmt::format("{}{}", name, l + 3), {1, r, c, channels});
      };
      trunk_out_.levels[l].features =
          features(fmt::format("p{}", l + 3), rows, columns, stride, static_cast<std::size_t>(model_.channels));
      trunk_out_.levels[l].objectness = part("objectness", a);
      trunk_out_.levels[l].deltas = part("deltas", a * 4);
    }
    const auto r = static_cast<std::size_t>(model_.input.height / model_.strides[0]),
               c = static_cast<std::size_t>(model_.input.width / model_.strides[0]);
    trunk_out_.semantic = output(trunk_, trunk_name_, "semantic", {1, r, c, TrunkOutput::kSemanticChannels});
    if (model_.refine.empty()) return;
    trunk_out_.fine =
        features("fine", model_.input.height / model_.fine_stride, model_.input.width / model_.fine_stride,
                 model_.fine_stride, static_cast<std::size_t>(model_.fine_channels));
  }

  static bool is_feature(const std::string& output) { return output.starts_with('p') || output == "fine"; }

  /// Features that the trunk computed in bfloat16, handed over as they are: widening them takes OpenVINO several times
  /// as long as it takes here.
  struct ShortOutput {
    ov::Tensor shorts;
    std::vector<float> floats;
    void widen() {
      const auto* from = static_cast<const std::uint16_t*>(shorts.data());
      for (std::size_t k = 0; k < floats.size(); ++k)
        floats[k] = std::bit_cast<float>(static_cast<std::uint32_t>(from[k]) << 16U);
    }
  };

  FeatureMap features(const std::string& name, int rows, int columns, int stride, std::size_t channels) {
    const Shape shape{1, static_cast<std::size_t>(rows), static_cast<std::size_t>(columns), channels};
    if (!short_features_) return {output(trunk_, trunk_name_, name, shape).data(), rows, columns, stride};
    ov::Tensor t = checked(trunk_, trunk_name_, name, ov::element::bf16, shape);
    short_outputs_.push_back({t, std::vector<float>(count(shape))});
    return {short_outputs_.back().floats.data(), rows, columns, stride};
  }

  ModelDescription model_;
  std::string trunk_name_;
  ov::InferRequest trunk_, box_;
  bool short_features_ = false;
  std::vector<ShortOutput> short_outputs_;  // a moved one keeps its memory
  TrunkOutput trunk_out_;
  std::span<const float> probabilities_, box_deltas_;
  std::vector<std::unique_ptr<OpenVinoMaskGraphs>> owned_masks_;
  std::vector<MaskGraphs*> masks_;
};

}  // namespace

Result<std::unique_ptr<NetworkGraphs>> make_openvino_graphs(const std::filesystem::path& folder,
                                                            const ModelDescription& model,
                                                            const GraphOptions& options) {
  try {
    return std::unique_ptr<NetworkGraphs>(std::make_unique<OpenVinoGraphs>(folder, model, options));
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInvalidInput, e.what()};
  }
}

bool have_openvino() { return true; }

FastNumbers fast_numbers() {
  const Instructions cpu = instructions();
  try {
    const auto types = core().get_property("CPU", ov::device::capabilities);
    const bool short_floats =
        std::any_of(types.begin(), types.end(), [](const std::string& t) { return t == "BF16" || t == "FP16"; });
    if (short_floats && (!cpu.intel || cpu.amx)) return FastNumbers::kShortFloats;
    return cpu.vnni ? FastNumbers::kEightBits : FastNumbers::kNone;
  } catch (const std::exception&) {
    return FastNumbers::kNone;
  }
}

}  // namespace semvslam

#else

namespace semvslam {

Result<std::unique_ptr<NetworkGraphs>> make_openvino_graphs(const std::filesystem::path&, const ModelDescription&,
                                                            const GraphOptions&) {
  return Error{ErrorCode::kUnsupported, "this build has no OpenVINO: `pip install openvino`, then configure again"};
}

bool have_openvino() { return false; }
FastNumbers fast_numbers() { return FastNumbers::kNone; }

}  // namespace semvslam

#endif
