#include "semvslam/semantic/default_model.h"

#include <fmt/core.h>

#include <array>

namespace semvslam {
namespace fs = std::filesystem;

Result<fs::path> default_model_folder() {
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  const std::array candidates{program.parent_path().parent_path() / "share" / "semvslam" / "models",
                              fs::path(SEMVSLAM_BUILD_MODELS), fs::path(SEMVSLAM_INSTALLED_MODELS)};
  for (const fs::path& folder : candidates)
    if (fs::is_regular_file(folder / "model.json", ec)) return folder;
  return Error{ErrorCode::kNotFound,
               fmt::format("the segmentation network is neither in {} nor in {}: name its folder (segment.model)",
                           candidates[0].string(), candidates[2].string())};
}

}  // namespace semvslam
