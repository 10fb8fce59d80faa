#include "semvslam/apps/segmenter_options.h"

#include <CLI/CLI.hpp>

namespace semvslam {

void add_segmenter_options(CLI::App& parser, SegmenterOptions& options) {
  options.keep_up = false;  // no camera waits
  parser.add_option("--model", options.model, "folder with model.json (default: the network that comes along)");
  parser.add_option("--threads", options.threads, "threads of the network; 0: by machine, as beside tracking")
      ->capture_default_str()
      ->check(CLI::Range(0, 64));
  parser.add_option("--backend", options.backend, "auto, openvino or opencv")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "openvino", "opencv"}));
  parser.add_option("--precision", options.precision, "auto (floats, of 16 bits where those are fast), f32 or int8")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "f32", "int8"}));
  parser
      .add_option("--input-width", options.input_width_px,
                  "of the image that the network sees, px; 0: 1.2 times the model's, in eight bits the model's")
      ->capture_default_str()
      ->check(CLI::Range(0, 4096));
}

}  // namespace semvslam
