#include <array>

#include "semvslam/apps/command.h"

namespace semvslam {

std::span<const Command> commands() {
  static constexpr std::array kCommands = {
      Command{"eval", "measure a trajectory against the ground truth: ATE, RPE, improvement, plot", setup_eval},
      Command{"version", "print the version", setup_version},
  };
  return kCommands;
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
