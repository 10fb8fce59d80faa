#pragma once

#include <cstddef>

namespace semvslam {

/// What a YAML text that a person wrote stays below; a foreign file is refused before its size costs time or memory.
inline constexpr std::size_t kMaxYamlBytes = 1 << 20;
inline constexpr int kMaxYamlNesting = 16;

}  // namespace semvslam
