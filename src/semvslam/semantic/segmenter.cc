#include "semvslam/semantic/segmenter.h"

#include <fmt/core.h>

#include "semvslam/semantic/default_model.h"
#include "semvslam/semantic/folder_segmenter.h"
#include "semvslam/semantic/network_segmenter.h"

namespace semvslam {
namespace {

/// Sees nothing, ever.
class NoSegmenter final : public Segmenter {
 public:
  Result<Segmentation> segment(const SegmentationRequest& request) override {
    return Segmentation{request.frame, request.stamp, request.image.size(), {}};
  }
  const std::vector<std::string>& class_names() const override { return names_; }
  std::string description() const override { return "no segmentation"; }

 private:
  std::vector<std::string> names_;
};

// How wide the network sees an image, where the options do not say, in widths of the model's input.
constexpr double kSlowMachineWidth = 0.65;  // less than half the time; persons near by lose little by it
constexpr double kEightBitWidth = 0.8;      // with instructions for eight bits: keeps up, a fifth to spare
// Where no camera waits: finds more small persons for half as much time again (in eight bits it does not).
constexpr double kStillsWidth = 1.2;

// Of the box head's weights, beside a camera: a third of the operations, and the same persons found.
constexpr double kKeepUpBoxEnergy = 0.88;

/// What suits the machine, where the options leave it open; the size of the model's input too.
GraphOptions settle(const SegmenterOptions& options, bool openvino, ModelDescription& model) {
  const FastNumbers fast = openvino ? fast_numbers() : FastNumbers::kShortFloats;
  // There the network is what all else waits for. Elsewhere a second thread, beside tracking and mapping, only waits.
  const bool slow = fast != FastNumbers::kShortFloats;
  const int threads = options.threads > 0 ? options.threads : slow ? 2 : 1;
  GraphOptions out{options.precision, threads};
  if (options.keep_up && options.precision == "auto") out.box_energy = kKeepUpBoxEnergy;
  int width_px = options.input_width_px;
  if (slow && options.keep_up && options.precision == "auto") {
    out.precision = model.trunk_int8.empty() ? "f32" : "int8";
    if (width_px == 0)
      width_px =
          static_cast<int>((fast == FastNumbers::kEightBits ? kEightBitWidth : kSlowMachineWidth) * model.input.width);
  }
  if (width_px == 0 && openvino && !options.keep_up && out.precision != "int8")
    width_px = static_cast<int>(kStillsWidth * model.input.width);
  if (width_px > 0) model.set_input_width(width_px);
  return out;
}

Result<std::unique_ptr<Segmenter>> make_network(const SegmenterOptions& options, const RoleTable& roles,
                                                StageTimers* timers) {
  const Result<std::filesystem::path> folder =
      options.model.empty() ? default_model_folder() : Result<std::filesystem::path>(options.model);
  if (!folder) return folder.error();
  Result<ModelDescription> model = ModelDescription::read(*folder);
  if (!model) return model.error();
  const bool openvino = options.backend == "openvino" || (options.backend == "auto" && have_openvino());
  if (!openvino && (options.input_width_px > 0 || options.precision == "int8"))
    return Error{ErrorCode::kUnsupported,
                 "segment.input_width_px and segment.precision=int8 need OpenVINO; OpenCV runs the network as it was "
                 "exported"};
  const GraphOptions settled = settle(options, openvino, *model);
  Result<std::unique_ptr<NetworkGraphs>> graphs =
      openvino ? make_openvino_graphs(*folder, *model, settled) : make_opencv_graphs(*folder, *model);
  if (!graphs) return graphs.error();
  NetworkSegmenter::Limits limits;
  limits.score = static_cast<float>(options.score);
  return std::unique_ptr<Segmenter>(
      std::make_unique<NetworkSegmenter>(std::move(*graphs), std::move(*model), limits, roles, timers));
}

}  // namespace

void SegmenterOptions::add_to(ConfigSchema& schema) {
  schema.add("segment.source", &source, {"network", "folder", "none"}, "where masks come from");
  schema.add("segment.model", &model, {}, "folder with the network's model.json; empty = the one that comes with it");
  schema.add("segment.backend", &backend, {"auto", "openvino", "opencv"}, "library that runs the network");
  schema.add("segment.precision", &precision, {"auto", "f32", "int8"},
             "auto = fastest type of this machine, f32 = alike everywhere, int8 = eight bits where the model has them");
  schema.add(
      "segment.input_width_px", &input_width_px, {0, 4096},
      "width of the image that the network sees: more finds smaller persons, less is faster; 0 = the model's, or "
      "less on processors without fast 16-bit floats: 0.8 of it with VNNI, else 0.65, px");
  schema.add("segment.mask_folder", &mask_folder, {}, "folder of masks (PNG), for source = folder");
  schema.add("segment.score", &score, {0.01, 1.0}, "least score of an object");
  schema.add("segment.threads", &threads, {0, 64},
             "threads of the network; 0 = one, or two on processors without fast 16-bit floats");
}

Result<std::unique_ptr<Segmenter>> make_segmenter(const SegmenterOptions& options, const RoleTable& roles,
                                                  StageTimers* timers) {
  if (options.source == "none") return std::unique_ptr<Segmenter>(std::make_unique<NoSegmenter>());
  if (options.source == "folder") {
    Result<std::unique_ptr<FolderSegmenter>> folder = FolderSegmenter::open(options.mask_folder, roles);
    if (!folder) return folder.error();
    return std::unique_ptr<Segmenter>(std::move(*folder));
  }
  if (options.source == "network") return make_network(options, roles, timers);
  return Error{ErrorCode::kInvalidInput,
               fmt::format("segment.source: '{}' is none of network, folder, none", options.source)};
}

}  // namespace semvslam
