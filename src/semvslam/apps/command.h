#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "semvslam/base/result.h"

namespace CLI {
class App;
}

namespace semvslam {

/// What the program returns to the shell; the same list stands in `semvslam help` and the README.
enum ExitCode : int {
  kExitSuccess = 0,
  kExitInternal = 1,  // our fault
  kExitUsage = 2,     // the command line cannot be understood
  kExitInput = 3,     // the data or the configuration cannot be used
  kExitIo = 4,        // reading or writing failed half way
  // 128 + signal number after an interrupt, with everything computed so far written
};

int exit_code_of(ErrorCode code);

/// Writes a result to standard output for "-", otherwise to a file, in one step.
Status write_report(const std::string& target, const std::string& content);

/// Runs a sub-command after its options were parsed. @return the exit code, or the Error that main() prints.
using CommandHandler = std::function<Result<int>()>;

struct Command {
  std::string_view name, summary;
  /// Adds options to the parser of this sub-command and returns what runs it.
  CommandHandler (*setup)(CLI::App& parser);
};

/// The sub-commands in the order in which the help shows them.
std::span<const Command> commands();

CommandHandler setup_run(CLI::App& parser);
CommandHandler setup_demo(CLI::App& parser);
CommandHandler setup_segment(CLI::App& parser);
CommandHandler setup_eval_seg(CLI::App& parser);
CommandHandler setup_eval_repair(CLI::App& parser);
CommandHandler setup_render(CLI::App& parser);
CommandHandler setup_map(CLI::App& parser);
CommandHandler setup_bench(CLI::App& parser);
CommandHandler setup_config(CLI::App& parser);
CommandHandler setup_eval(CLI::App& parser);
CommandHandler setup_view(CLI::App& parser);
CommandHandler setup_download(CLI::App& parser);
CommandHandler setup_version(CLI::App& parser);

}  // namespace semvslam
