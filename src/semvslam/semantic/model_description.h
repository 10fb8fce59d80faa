#pragma once

#include <array>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// What model.json says of an exported network; training/README.md explains every number.
struct ModelDescription {
  static constexpr int kLevels = 3;
  static constexpr int kRefineSide = 56;  // cells along an edge of a refined mask, as the graph was exported

  std::string name, trunk, box, mask;  // files beside model.json
  std::string trunk_int8;              // the trunk in eight-bit numbers, for OpenVINO; empty = none
  std::string refine;                  // sharpens masks with the trunk's fine features; empty = none
  cv::Size input;
  int trained_width_px = 0;  // what the input's width was when the network was exported
  int pad = 127;             // value of the pixels that the image does not cover
  std::vector<std::string> classes;
  std::array<int, kLevels> strides{};
  std::array<std::vector<float>, kLevels> anchor_sizes;
  std::vector<float> anchor_ratios;
  std::array<float, 4> box_weights{};
  std::vector<float> box_levels, mask_levels;
  int channels = 0;
  float semantic_share = 0;                // weight of the semantic map in a person's mask
  float mask_threshold = 0.5f;             // of a person's mixed mask
  int fine_stride = 0, fine_channels = 0;  // of the features that the refinement reads
  float refine_margin = 0;                 // what it sees around a box, as a share of width and height
  int refine_side = kRefineSide;           // cells along an edge of a refined mask

  /// 10^9 operations (two to a multiply-add) that each graph takes, counted when it was exported; 0 = not known.
  struct Cost {
    double trunk = 0, box_region = 0, mask_region = 0, refine_region = 0;
    double of_image(int proposals, int masks) const {
      return trunk + proposals * box_region + masks * (mask_region + refine_region);
    }
  } gflops;

  /// The network shall see images of another size: as wide as that, or nearly (sides are multiples of the coarsest
  /// stride), in the same shape. In smaller images masks are refined in fewer cells, which stay about as large as they
  /// were trained to be. @param width_px 32 to 4096.
  void set_input_width(int width_px);
  int anchors_per_cell() const { return static_cast<int>(anchor_sizes[0].size() * anchor_ratios.size()); }

  /// Errors: no JSON, a key missing or out of range. @param origin for messages.
  static Result<ModelDescription> parse(const std::string& text, const std::string& origin);
  /// Reads folder/model.json. Errors: missing, no JSON, a key missing or out of range, a file that it names missing.
  static Result<ModelDescription> read(const std::filesystem::path& folder);
};

}  // namespace semvslam
