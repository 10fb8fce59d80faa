#include <fmt/core.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "semvslam/apps/command.h"
#include "semvslam/apps/interrupt.h"
#include "semvslam/base/foreign_text.h"

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

std::string unknown_command(std::string_view name) {
  const auto distance = [&](const Command& c) { return edit_distance(name.substr(0, 40), c.name); };
  const auto nearest = std::min_element(commands().begin(), commands().end(),
                                        [&](const Command& a, const Command& b) { return distance(a) < distance(b); });
  return fmt::format("unknown command {}; the nearest known one is '{}' (see 'semvslam help')", in_quotes(name),
                     nearest->name);
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

  const auto is_asked_for = [&](const auto& handler) { return handler.first->get_name() == argv[1]; };
  if (argc > 1 && argv[1][0] != '-' && argv[1] != help->get_name() &&
      std::none_of(handlers.begin(), handlers.end(), is_asked_for))
    return fail(kExitUsage, unknown_command(argv[1]));
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
    if (result) return *result;
    const int signal = InterruptGuard::received();
    return fail(signal != 0 ? 128 + signal : exit_code_of(result.error().code), result.error().message);
  }
  fmt::print("{}", help_text);
  return help->parsed() ? kExitSuccess : kExitUsage;
}

}  // namespace
}  // namespace semvslam

int main(int argc, char** argv) {
  try {
    semvslam::keep_images_out_of_the_heap();
    const int code = semvslam::run(argc, argv);
    if (std::fflush(stdout) == 0) return code;
    return semvslam::fail(semvslam::kExitIo, std::string("standard output: cannot write: ") + std::strerror(errno));
  } catch (const std::exception& e) {
    if (std::ferror(stdout) != 0) return semvslam::fail(semvslam::kExitIo, std::string("standard output: ") + e.what());
    return semvslam::fail(semvslam::kExitInternal, std::string("internal: ") + e.what());
  }
}
