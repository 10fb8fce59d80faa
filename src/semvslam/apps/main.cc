#include <fmt/core.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <CLI/CLI.hpp>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "semvslam/apps/command.h"

namespace semvslam {
namespace {

constexpr const char* kFooter =
    "Exit codes: 0 success, 1 internal error, 2 wrong command line, 3 unusable input or configuration, 4 reading or\n"
    "writing failed, 128 + signal when interrupted. `semvslam COMMAND --help` shows a command's options.";

int fail(int code, std::string message) {
  for (char& c : message)
    if (c == '\n' || c == '\r') c = ' ';
  fmt::print(stderr, "semvslam: error: {}\n", message);
  return code;
}

/// Images and other big blocks come and go with every frame, key frames stay. In one heap the latter pin the holes
/// between the former: a long run over old places, with as many key frames as before, grew from 88 to 136 MB. glibc
/// would move the border between mapped blocks and the heap up to the size of the largest block freed; here it stays
/// where it starts.
void keep_images_out_of_the_heap() {
#ifdef __GLIBC__
  constexpr int kMappedFrom = 128 << 10, kKeptFree = 32 << 20;  // bytes
  mallopt(M_MMAP_THRESHOLD, kMappedFrom);
  mallopt(M_TRIM_THRESHOLD, kKeptFree);
#endif
}

int run(int argc, char** argv) {
  CLI::App program("semvslam: RGB-D SLAM for scenes with people", "semvslam");
  program.footer(kFooter);
  program.require_subcommand(0, 1);
  program.set_version_flag("--version", std::string("semvslam ") + SEMVSLAM_VERSION);
  std::vector<std::pair<CLI::App*, CommandHandler>> handlers;
  for (const Command& command : commands()) {
    CLI::App* parser = program.add_subcommand(std::string(command.name), std::string(command.summary));
    handlers.emplace_back(parser, command.setup(*parser));
  }
  const CLI::App* help = program.add_subcommand("help", "show this help");
  const std::string help_text = program.help();  // after parsing, it would be that of the parsed sub-command

  try {
    program.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help, --version
    return program.exit(request);
  } catch (const CLI::ParseError& e) {
    return fail(kExitUsage, std::string(e.what()) + " (see 'semvslam help')");
  }
  for (const auto& [parser, handler] : handlers) {
    if (!parser->parsed()) continue;
    const Result<int> result = handler();
    return result ? *result : fail(exit_code_of(result.error().code), result.error().message);
  }
  fmt::print("{}", help_text);
  return help->parsed() ? kExitSuccess : kExitUsage;
}

}  // namespace
}  // namespace semvslam

int main(int argc, char** argv) {
  try {
    semvslam::keep_images_out_of_the_heap();
    return semvslam::run(argc, argv);
  } catch (const std::exception& e) {
    return semvslam::fail(semvslam::kExitInternal, std::string("internal: ") + e.what());
  }
}
