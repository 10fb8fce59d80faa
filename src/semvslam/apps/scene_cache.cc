#include "semvslam/apps/scene_cache.h"

#include <fmt/core.h>

#include <cstdlib>
#include <string>

#include "semvslam/apps/render_scene.h"
#include "semvslam/data/file_io.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

fs::path cache_folder(const fs::path& fallback) {
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg != nullptr && *xdg != '\0')
    return fs::path(xdg) / "semvslam";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return fs::path(home) / ".cache/semvslam";
  return fallback / "cache";
}

/// All that the pictures depend on. The version is part of it: another version may render other ones.
std::string cache_name(const SceneOptions& s) {
  return fmt::format("scene_{}_{}_{}_{}x{}_{}_{}hz_{}{}{}", SEMVSLAM_VERSION, s.people, s.motion, s.width_px,
                     s.height_px, s.frames, s.frame_rate_hz, s.seed, s.noise ? "" : "_exact",
                     s.motion_blur ? "_blur" : "");
}

}  // namespace

Result<fs::path> cached_scene(const SceneOptions& scene, const fs::path& fallback, bool quiet) {
  const fs::path cache = cache_folder(fallback);
  const fs::path folder = cache / cache_name(scene);
  if (fs::exists(folder)) return folder;
  if (const Status status = make_folder(cache); !status) return status.error();
  if (!quiet) fmt::print(stderr, "rendering {} frames to {}\n", scene.frames, folder.string());
  if (const Status status = render_to_folder(scene, folder, false, quiet); !status) return status.error();
  return folder;
}

}  // namespace semvslam
