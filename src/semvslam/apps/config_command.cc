#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "semvslam/apps/command.h"
#include "semvslam/pipeline/config.h"

namespace semvslam {

CommandHandler setup_config(CLI::App& parser) {
  auto markdown = std::make_shared<bool>(false);
  parser.add_flag("--markdown", *markdown, "a table for documentation instead of a YAML file with the defaults");
  return [markdown]() -> Result<int> {
    Config config;
    const ConfigSchema schema = config.schema();
    fmt::print("{}", *markdown ? schema.markdown() : schema.dump_yaml());
    return static_cast<int>(kExitSuccess);
  };
}

}  // namespace semvslam
