#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace semvslam {

/// Foreign text for a message: in quotation marks, without control characters, shortened. A message must stay one
/// readable line whatever the input holds.
std::string in_quotes(std::string_view text);

/// How many insertions, deletions, substitutions and swaps of neighbours lead from one word to the other (optimal
/// string alignment): finds the key that was meant.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace semvslam
