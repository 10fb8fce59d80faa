#pragma once

#include <filesystem>

#include "semvslam/base/result.h"
#include "semvslam/render/scene_source.h"

namespace semvslam {

/// The folder of a rendered scene that is kept for later calls: $XDG_CACHE_HOME/semvslam, ~/.cache/semvslam, or, where
/// neither is known, `fallback`/cache. Renders the scene where it is not there yet (see render_to_folder) and says so
/// on standard error. Errors: as render_to_folder; the folder cannot be made.
Result<std::filesystem::path> cached_scene(const SceneOptions& scene, const std::filesystem::path& fallback,
                                           bool quiet);

}  // namespace semvslam
