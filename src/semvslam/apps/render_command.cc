#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "semvslam/apps/command.h"
#include "semvslam/apps/render_scene.h"

namespace semvslam {
namespace {

struct RenderArguments {
  SceneOptions scene;
  std::string out, size = "640x480";
  bool jpeg = false, exact = false, quiet = false;
};

Result<int> render(RenderArguments& a) {
  if (!parse_size(a.size, a.scene.width_px, a.scene.height_px))
    return Error{ErrorCode::kInvalidInput, fmt::format("--size is WIDTHxHEIGHT like 640x480, got '{}'", a.size)};
  a.scene.noise = !a.exact;
  if (const Status status = render_to_folder(a.scene, a.out, a.jpeg, a.quiet); !status) return status.error();
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_render(CLI::App& parser) {
  auto a = std::make_shared<RenderArguments>();
  parser.add_option("--out", a->out, "folder of the recording; must not exist")->required();
  parser.add_option("--people", a->scene.people, "walking, sitting, carrying or none")->capture_default_str();
  parser.add_option("--motion", a->scene.motion, "of the camera: xyz, rpy, halfsphere, static or tour")
      ->capture_default_str();
  parser.add_option("--size", a->size, "of the images, px")->capture_default_str();
  parser.add_option("--frames", a->scene.frames, "how many")->capture_default_str();
  parser.add_option("--rate", a->scene.frame_rate_hz, "frames per second")->capture_default_str();
  parser.add_option("--seed", a->scene.seed, "of everything that is random")->capture_default_str();
  parser.add_option("--threads", a->scene.threads, "that render; they do not change the pictures")
      ->capture_default_str();
  parser.add_flag("--exact", a->exact, "no noise in depth and colour");
  parser.add_flag("--blur", a->scene.motion_blur, "motion blur");
  parser.add_flag("--jpeg", a->jpeg, "colour images as JPEG");
  parser.add_flag("--quiet", a->quiet, "no progress on the terminal");
  return [a] { return render(*a); };
}

}  // namespace semvslam
