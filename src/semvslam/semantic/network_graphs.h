#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <span>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/semantic/model_description.h"
#include "semvslam/semantic/roi_align.h"

namespace semvslam {

/// One pyramid level as the trunk gives it; memory of the graphs, valid until the next call of trunk().
struct TrunkLevel {
  FeatureMap features;
  std::span<const float> objectness;  // one per anchor
  std::span<const float> deltas;      // four per anchor
};
struct TrunkOutput {
  std::array<TrunkLevel, ModelDescription::kLevels> levels;
  /// Probabilities at the finest level's cells, kSemanticChannels a cell: person, other mover, movable.
  std::span<const float> semantic;
  static constexpr int kSemanticChannels = 3;
  FeatureMap fine;  // for the refinement of masks; no data where the model has none
};

/// What the box head says of some regions; memory of the graphs, valid until its next call.
struct BoxHeadOutput {
  std::span<const float> probabilities;  // 1 + classes per region, the first is background
  std::span<const float> deltas;         // four per region
};

/// Where the refinement reads one region from; memory of the graphs. Both are empty where the model has no refinement.
struct RefineInput {
  std::span<float> logits;    // of the mask, refine_side x refine_side, positive = inside
  std::span<float> features;  // refine_side x refine_side x fine_channels
};

/// The graphs that make one object's mask. One thread at a time, whatever the others do.
class MaskGraphs {
 public:
  virtual ~MaskGraphs() = default;
  /// Where the features of a region are to be written before mask_head().
  virtual std::span<float> mask_input() = 0;
  /// @return kMaskChannels x kMaskSide x kMaskSide probabilities.
  virtual Result<std::span<const float>> mask_head() = 0;
  /// The refinement of one region's mask. @return refine_side x refine_side probabilities, inside where >= 0.5.
  virtual RefineInput refine_input() = 0;
  virtual Result<std::span<const float>> refine_head() = 0;
};

/// The parts of a network as some inference library runs them. Not safe for concurrent use, but for its mask graphs.
class NetworkGraphs {
 public:
  // Regions of one call of the box head (below 96 OpenVINO takes a kernel that makes 64 slower than 100); cells along
  // an edge.
  static constexpr int kBoxBatch = 100, kBoxCells = 7;
  static constexpr int kMaskCells = 14, kMaskSide = 28, kMaskChannels = 2;

  virtual ~NetworkGraphs() = default;
  /// @param image CV_8UC3 BGR of the model's input size.
  virtual Result<TrunkOutput> trunk(const cv::Mat& image) = 0;
  /// Where the features of kBoxBatch regions are to be written before box_head().
  virtual std::span<float> box_input() = 0;
  virtual Result<BoxHeadOutput> box_head() = 0;
  /// One object's mask after the other is made by each of these: an image has few. One or more, all alike.
  virtual std::span<MaskGraphs* const> mask_graphs() = 0;
  virtual std::string description() const = 0;
};

struct GraphOptions {
  /// "auto" (the float graphs in the fastest float type of the machine), "f32", or "int8": the trunk in eight bits,
  /// which a model may lack.
  std::string precision = "auto";
  int threads = 1;
  /// Share of the box head's weights, as a sum of squares, that is kept where its products can be made cheaper by half
  /// (see factor()); 1 = all.
  double box_energy = 1;
};

/// The trunk takes images of model.input, whatever it was exported for.
/// Errors: a graph that cannot be read, or whose inputs and outputs differ from the description (the message names the
/// tensor), eight bits that the model lacks (kInvalidInput), or a build without OpenVINO (kUnsupported).
Result<std::unique_ptr<NetworkGraphs>> make_openvino_graphs(const std::filesystem::path& folder,
                                                            const ModelDescription& model, const GraphOptions& options);
/// The same by OpenCV's DNN module: slower, reads ONNX graphs only.
Result<std::unique_ptr<NetworkGraphs>> make_opencv_graphs(const std::filesystem::path& folder,
                                                          const ModelDescription& model);
bool have_openvino();

/// In which numbers a processor computes convolutions fast.
enum class FastNumbers {
  kShortFloats,  // sixteen-bit floats: twice as fast as 32 bits, or more
  kEightBits,    // products of eight bits in one instruction (VNNI): 1.7 times as fast as floats
  kNone,         // eight bits help, by instructions that were not made for it
};
/// Of this processor; kNone without OpenVINO. Intel's AVX-512 multiplies bfloat16 no faster than 32-bit floats, so that
/// there sixteen bits count only with AMX, which virtual machines often lack.
FastNumbers fast_numbers();

}  // namespace semvslam
