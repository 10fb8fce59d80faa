#include <fmt/core.h>

#include <array>

#include "semvslam/apps/command.h"
#include "semvslam/data/file_io.h"

namespace semvslam {

std::span<const Command> commands() {
  static constexpr std::array kCommands = {
      Command{"demo", "the main job on a rendered room with people in it", setup_demo},
      Command{"run", "the main job: trajectory, key frames, map and statistics of a recording", setup_run},
      Command{"eval", "measure a trajectory against the ground truth: ATE, RPE, improvement, plot", setup_eval},
      Command{"bench", "many recordings in many modes: the paper's tables and figures", setup_bench},
      Command{"segment", "find people and things in pictures: overlay, instance image, JSON", setup_segment},
      Command{"eval-seg", "score the segmentation against labelled pictures", setup_eval_seg},
      Command{"eval-repair", "damage masks and measure what their repair is worth", setup_eval_repair},
      Command{"render", "write a rendered recording with exact ground truth and masks", setup_render},
      Command{"map", "what a saved map holds, and its export for other programs", setup_map},
      Command{"view", "a web page that shows recorded runs, or one that is going on", setup_view},
      Command{"download", "fetch recordings of public benchmarks", setup_download},
      Command{"config", "show every configuration value with its meaning", setup_config},
      Command{"version", "print the version", setup_version},
  };
  return kCommands;
}

Status write_report(const std::string& target, const std::string& content) {
  if (target != "-") return write_file_atomically(target, content);
  fmt::print("{}", content);
  return Status::success();
}

int exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidInput:
    case ErrorCode::kNotFound:
    case ErrorCode::kUnsupported:
      return kExitInput;
    case ErrorCode::kIo:
      return kExitIo;
    case ErrorCode::kInternal:
      break;
  }
  return kExitInternal;
}

}  // namespace semvslam
