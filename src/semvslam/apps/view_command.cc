#include <fmt/core.h>
#include <poll.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "semvslam/apps/command.h"
#include "semvslam/apps/interrupt.h"
#include "semvslam/web/folder_watch.h"
#include "semvslam/web/page.h"
#include "semvslam/web/view_server.h"

namespace semvslam {
namespace {

struct ViewArguments {
  std::vector<std::string> folders;
  std::string out, dense, truth;
  std::size_t points = ViewOptions{}.most_points;
  bool serve = false;
  ServerOptions server;
};

ViewOptions options_of(const ViewArguments& a) {
  ViewOptions options;
  options.dense = a.dense;
  options.truth = a.truth;
  options.most_points = a.points / a.folders.size();
  return options;
}

Result<int> write_page(const ViewArguments& a) {
  Scene scene;
  for (const std::string& folder : a.folders) {
    Result<ViewedRun> run = read_run(folder, options_of(a));
    if (!run) return run.error();
    for (const std::string& remark : run->remarks) fmt::print(stderr, "semvslam: warning: {}: {}\n", run->name, remark);
    scene.runs.push_back(std::move(*run));
  }
  scene.in_truth_world = bring_together(scene.runs);
  const std::string page = format_page(scene);
  const std::string out = a.out.empty() ? (std::filesystem::path(a.folders[0]) / "view.html").string() : a.out;
  if (const Status status = write_report(out, page); !status) return status.error();
  if (out != "-") fmt::print("{}: {:.1f} MB, for any browser\n", out, static_cast<double>(page.size()) / 1e6);
  return static_cast<int>(kExitSuccess);
}

/// Until a signal ends it. @return 128 + signal
Result<int> serve_page(const ViewArguments& a) {
  const std::string& folder = a.folders[0];
  const InterruptDescriptor interrupt;
  Result<FolderWatch> watch = FolderWatch::create(folder);
  if (!watch) return watch.error();
  const Result<std::unique_ptr<ViewServer>> server = ViewServer::start(folder, options_of(a), a.server);
  if (!server) return server.error();
  fmt::print("{} at {} (Ctrl-C ends it)\n", folder, (*server)->url());
  std::fflush(stdout);  // it may be a file or a pipe that somebody waits for
  std::array<pollfd, 2> wanted{{{interrupt.descriptor(), POLLIN, 0}, {watch->descriptor(), POLLIN, 0}}};
  for (;;) {
    ::poll(wanted.data(), wanted.size(), -1);
    if (const int signal = interrupt.received(); signal != 0) return 128 + signal;
    for (const std::string& name : watch->changed()) (*server)->file_changed(name);
  }
}

}  // namespace

CommandHandler setup_view(CLI::App& parser) {
  auto a = std::make_shared<ViewArguments>();
  parser.add_option("RUN_DIR", a->folders, "folders that 'semvslam run --out' wrote; several are compared")->required();
  CLI::Option* out =
      parser.add_option("--out", a->out, "the page (default: view.html in RUN_DIR; - = standard output)");
  parser.add_option("--dense", a->dense, "a point cloud (PLY) to show instead of RUN_DIR's dense.ply or map.ply");
  parser.add_option(
      "--truth", a->truth,
      "recording or trajectory file with the true poses, instead of the one that the run was scored with");
  parser.add_option("--points", a->points, "show at most so many points, 12 bytes each")
      ->capture_default_str()
      ->check(CLI::Range(1000, 5'000'000));
  CLI::Option* serve =
      parser.add_flag("--serve", a->serve, "show the run while it goes on, until Ctrl-C")->excludes(out);
  parser.add_option("--port", a->server.port, "where to serve; 0 = any that is free")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535))
      ->needs(serve);
  parser.add_option("--address", a->server.address, "where to serve; 0.0.0.0 lets other machines in")
      ->capture_default_str()
      ->needs(serve);
  parser.callback([a] {
    if (a->folders.size() > 1 && a->serve) throw CLI::ValidationError("view --serve shows one RUN_DIR");
    if (a->folders.size() > 1 && !a->dense.empty()) throw CLI::ValidationError("view --dense goes with one RUN_DIR");
  });
  return [a] { return a->serve ? serve_page(*a) : write_page(*a); };
}

}  // namespace semvslam
