#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "semvslam/apps/command.h"
#include "semvslam/apps/run_session.h"
#include "semvslam/apps/scene_cache.h"
#include "semvslam/data/file_io.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

struct DemoArguments {
  SceneOptions scene;
  std::string out = "semvslam_demo";
  bool quiet = false;
};

Result<int> run_mode(const DemoArguments& a, const fs::path& sequence, const std::string& mode) {
  Config config;
  if (const Status status = config.apply_mode(mode); !status) return status.error();
  RunOptions options;
  options.out = fs::path(a.out) / mode;
  options.dense_maps = {options.out / "dense.ply"};
  options.quiet = a.quiet;
  options.before = ProcessTime::now();
  return run_recording(sequence, {}, config, options);
}

Result<int> demo(const DemoArguments& a) {
  // Now: rendering takes long enough to find out afterwards.
  if (const Status status = make_folder(a.out); !status) return status.error();
  const Result<fs::path> sequence = cached_scene(a.scene, a.out, a.quiet);
  if (!sequence) return sequence.error();
  // The same pictures twice: what people do to a system that takes everything for static, and what is left of it.
  for (const char* mode : {"orb", "full"}) {
    if (!a.quiet) fmt::print("\nmode {}\n", mode);
    const Result<int> code = run_mode(a, *sequence, mode);
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
