#include <fmt/core.h>

#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>

#include "semvslam/semantic/network_graphs.h"

namespace semvslam {
namespace {

class OpenCvGraphs final : public NetworkGraphs, public MaskGraphs {
 public:
  OpenCvGraphs(const std::filesystem::path& folder, const ModelDescription& model)
      : model_(model),
        trunk_(read(folder / model.trunk)),
        box_(read(folder / model.box)),
        mask_(read(folder / model.mask)) {
    const int box_shape[] = {kBoxBatch, kBoxCells, kBoxCells, model.channels};
    const int mask_shape[] = {1, kMaskCells, kMaskCells, model.channels};
    box_in_ = cv::Mat::zeros(4, box_shape, CV_32F);
    mask_in_ = cv::Mat::zeros(4, mask_shape, CV_32F);
    if (!model.refine.empty()) {
      refine_ = read(folder / model.refine);
      const int logits_shape[] = {1, ModelDescription::kRefineSide, ModelDescription::kRefineSide};
      const int features_shape[] = {1, ModelDescription::kRefineSide, ModelDescription::kRefineSide,
                                    model.fine_channels};
      logits_in_ = cv::Mat::zeros(3, logits_shape, CV_32F);
      fine_in_ = cv::Mat::zeros(4, features_shape, CV_32F);
    }
    // OpenCV knows the shapes for certain only once a graph has run; this also makes the first image as fast as the
    // others.
    check(model.trunk, trunk(cv::Mat::zeros(model.input, CV_8UC3)));
    check(model.box, box_head());
    check(model.mask, mask_head());
    if (!model.refine.empty()) check(model.refine, refine_head());
  }

  Result<TrunkOutput> trunk(const cv::Mat& image) override {
    return guarded<TrunkOutput>([&] {
      trunk_.setInput(cv::dnn::blobFromImage(image, 1.0 / 127.5, cv::Size(), cv::Scalar::all(127.5), true));
      std::vector<cv::String> names;
      for (const char* kind : {"p", "objectness", "deltas"})
        for (int l = 3; l < 3 + ModelDescription::kLevels; ++l) names.push_back(fmt::format("{}{}", kind, l));
      const std::size_t semantic = names.size();
      names.emplace_back("semantic");
      if (!model_.refine.empty()) names.emplace_back("fine");
      outputs_.clear();
      trunk_.forward(outputs_, names);
      TrunkOutput out;
      for (std::size_t l = 0; l < out.levels.size(); ++l) {
        const int stride = model_.strides[l], rows = model_.input.height / stride,
                  columns = model_.input.width / stride;
        const std::size_t cells = static_cast<std::size_t>(rows) * columns, anchors = cells * model_.anchors_per_cell();
        out.levels[l].features = {numbers(outputs_[l], cells * model_.channels, names[l]).data(), rows, columns,
                                  stride};
        out.levels[l].objectness = numbers(outputs_[l + 3], anchors, names[l + 3]);
        out.levels[l].deltas = numbers(outputs_[l + 6], anchors * 4, names[l + 6]);
      }
      const std::size_t finest =
          static_cast<std::size_t>(model_.input.height / model_.strides[0]) * (model_.input.width / model_.strides[0]);
      out.semantic = numbers(outputs_[semantic], finest * TrunkOutput::kSemanticChannels, names[semantic]);
      if (!model_.refine.empty()) {
        const int rows = model_.input.height / model_.fine_stride, columns = model_.input.width / model_.fine_stride;
        const std::size_t count = static_cast<std::size_t>(rows) * columns * model_.fine_channels;
        out.fine = {numbers(outputs_.back(), count, names.back()).data(), rows, columns, model_.fine_stride};
      }
      return out;
    });
  }

  std::span<float> box_input() override { return {box_in_.ptr<float>(), box_in_.total()}; }
  std::span<MaskGraphs* const> mask_graphs() override { return masks_; }
  std::span<float> mask_input() override { return {mask_in_.ptr<float>(), mask_in_.total()}; }

  Result<BoxHeadOutput> box_head() override {
    return guarded<BoxHeadOutput>([&] {
      box_.setInput(box_in_);
      const std::vector<cv::String> names{"probabilities", "deltas"};
      box_out_.clear();
      box_.forward(box_out_, names);
      return BoxHeadOutput{numbers(box_out_[0], kBoxBatch * (model_.classes.size() + 1), names[0]),
                           numbers(box_out_[1], kBoxBatch * 4, names[1])};
    });
  }

  Result<std::span<const float>> mask_head() override {
    return guarded<std::span<const float>>([&] {
      mask_.setInput(mask_in_);
      mask_out_ = mask_.forward("masks");
      return numbers(mask_out_, static_cast<std::size_t>(kMaskChannels) * kMaskSide * kMaskSide, "masks");
    });
  }

  RefineInput refine_input() override {
    if (model_.refine.empty()) return {};
    return {{logits_in_.ptr<float>(), logits_in_.total()}, {fine_in_.ptr<float>(), fine_in_.total()}};
  }

  Result<std::span<const float>> refine_head() override {
    return guarded<std::span<const float>>([&] {
      refine_.setInput(logits_in_, "logits");
      refine_.setInput(fine_in_, "features");
      refined_ = refine_.forward("masks");
      return numbers(refined_, static_cast<std::size_t>(ModelDescription::kRefineSide) * ModelDescription::kRefineSide,
                     "masks");
    });
  }

  std::string description() const override { return fmt::format("{} by OpenCV {}", model_.name, CV_VERSION); }

 private:
  static cv::dnn::Net read(const std::filesystem::path& file) {
    if (file.extension() != ".onnx")
      throw std::runtime_error(fmt::format("{}: OpenCV reads .onnx graphs only", file.string()));
    try {
      cv::dnn::Net net = cv::dnn::readNetFromONNX(file.string());
      net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
      return net;
    } catch (const cv::Exception& e) {
      throw std::runtime_error(fmt::format("{}: is damaged or no ONNX graph ({})", file.string(), e.err));
    }
  }

  template <typename T>
  static void check(const std::string& file, const Result<T>& output) {
    if (!output) throw std::runtime_error(fmt::format("{}: {}", file, output.error().message));
  }

  static std::span<const float> numbers(const cv::Mat& m, std::size_t wanted, const std::string& name) {
    if (m.type() != CV_32F || m.total() != wanted || !m.isContinuous())
      throw std::runtime_error(fmt::format("output '{}' has {} numbers, expected {}", name, m.total(), wanted));
    return {m.ptr<float>(), m.total()};
  }

  template <typename T, typename Action>
  static Result<T> guarded(Action action) {
    try {
      return action();
    } catch (const std::exception& e) {
      return Error{ErrorCode::kInternal, fmt::format("OpenCV DNN: {}", e.what())};
    }
  }

  ModelDescription model_;
  cv::dnn::Net trunk_, box_, mask_, refine_;
  cv::Mat box_in_, mask_in_, mask_out_, logits_in_, fine_in_, refined_;
  std::vector<cv::Mat> outputs_, box_out_;
  const std::array<MaskGraphs*, 1> masks_{this};
};

}  // namespace

Result<std::unique_ptr<NetworkGraphs>> make_opencv_graphs(const std::filesystem::path& folder,
                                                          const ModelDescription& model) {
  try {
    return std::unique_ptr<NetworkGraphs>(std::make_unique<OpenCvGraphs>(folder, model));
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInvalidInput, fmt::format("OpenCV DNN: {}", e.what())};
  }
}

}  // namespace semvslam
