#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// Names of the modes, from least to most evidence of motion.
const std::vector<std::string>& mode_names();

/// The preset file of a mode (presets/<mode>.yaml in the sources), as YAML. Errors: an unknown mode.
Result<std::string_view> preset_of(std::string_view mode);

}  // namespace semvslam
