#pragma once

#include "semvslam/base/ids.h"

namespace semvslam {

using SubMapId = Id<struct SubMapTag>;  // key frames that share a world; the less, the older

/// As people count them, in messages and in names of files: from 1.
constexpr std::uint32_t number_of(SubMapId id) { return id.value + 1; }

}  // namespace semvslam
