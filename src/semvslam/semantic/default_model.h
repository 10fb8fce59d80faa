#pragma once

#include <filesystem>

#include "semvslam/base/result.h"

namespace semvslam {

/// The folder of the network that comes with semvslam: share/semvslam/models beside the running program's folder, then
/// the source tree it was built from, then the place of installation. Errors: none of them holds a model.json.
Result<std::filesystem::path> default_model_folder();

}  // namespace semvslam
