#pragma once

#include <string>
#include <string_view>

namespace semvslam {

/// Foreign text for use inside HTML and SVG, as content or as an attribute in quotation marks: & < > " ' escaped,
/// control characters replaced by blanks, bytes that are no UTF-8 by U+FFFD (one would make an SVG file unreadable).
std::string escape_markup(std::string_view text);

}  // namespace semvslam
