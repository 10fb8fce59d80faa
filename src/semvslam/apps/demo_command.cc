#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "semvslam/apps/command.h"
#include "semvslam/apps/render_scene.h"
#include "semvslam/apps/run_session.h"
#include "semvslam/data/file_io.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

struct DemoArguments {
  SceneOptions scene;
  std::string out = "semvslam_demo";
  bool quiet = false;
};

/// $XDG_CACHE_HOME/semvslam, ~/.cache/semvslam, or a folder beside the results where neither is known.
fs::path cache_folder(const fs::path& fallback) {
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg != nullptr && *xdg != '\0')
    return fs::path(xdg) / "semvslam";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return fs::path(home) / ".cache/semvslam";
  return fallback / "cache";
}

Result<int> run_mode(const DemoArguments& a, const fs::path& sequence, const std::string& mode) {
  Config config;
  if (const Status status = config.apply_mode(mode); !status) return status.error();
  RunOptions options;
  options.out = fs::path(a.out) / mode;
  options.dense_map = options.out / "dense.ply";
  options.quiet = a.quiet;
  options.before = ProcessTime::now();
  return run_recording(sequence, {}, config, options);
}

Result<int> demo(const DemoArguments& a) {
  const fs::path cache = cache_folder(a.out);
  // The version is part of the name: another version may render other pictures.
  const fs::path sequence =
      cache / fmt::format("demo_{}_{}_{}_{}x{}_{}_{}", SEMVSLAM_VERSION, a.scene.people, a.scene.motion,
                          a.scene.width_px, a.scene.height_px, a.scene.frames, a.scene.seed);
  // Now: rendering takes long enough to find out afterwards.
  if (const Status status = make_folder(a.out); !status) return status.error();
  if (!fs::exists(sequence)) {
    if (const Status status = make_folder(cache); !status) return status.error();
    if (!a.quiet) fmt::print(stderr, "rendering {} frames to {}\n", a.scene.frames, sequence.string());
    if (const Status status = render_to_folder(a.scene, sequence, false, a.quiet); !status) return status.error();
  }
  // The same pictures twice: what people do to a system that takes everything for static, and what is left of it.
  for (const char* mode : {"orb", "full"}) {
    if (!a.quiet) fmt::print("\nmode {}\n", mode);
    const Result<int> code = run_mode(a, sequence, mode);
    if (!code || *code != kExitSuccess) return code;
  }
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_demo(CLI::App& parser) {
  auto a = std::make_shared<DemoArguments>();
  a->scene.frames = 240;
  parser.add_option("--out", a->out, "folder for the results, one folder per mode in it")->capture_default_str();
  parser.add_option("--people", a->scene.people, "walking, sitting, carrying or none")->capture_default_str();
  parser.add_option("--motion", a->scene.motion, "of the camera: xyz, rpy, halfsphere, static or tour")
      ->capture_default_str();
  parser.add_option("--frames", a->scene.frames, "how many")->capture_default_str();
  parser.add_option("--seed", a->scene.seed, "of everything that is random")->capture_default_str();
  parser.add_flag("--quiet", a->quiet, "no progress on the terminal");
  return [a] { return demo(*a); };
}

}  // namespace semvslam
