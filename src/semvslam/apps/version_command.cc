#include <fmt/core.h>

#include "semvslam/apps/command.h"

namespace semvslam {

CommandHandler setup_version(CLI::App&) {
  return []() -> Result<int> {
    fmt::print("semvslam {}\n", SEMVSLAM_VERSION);
    return static_cast<int>(kExitSuccess);
  };
}

}  // namespace semvslam
