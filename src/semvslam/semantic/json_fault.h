#pragma once

#include <exception>
#include <string>
#include <string_view>

namespace semvslam {

/// What an exception of the JSON library, or of what reads a document, says for a user: without the library's own name
/// and number in brackets.
inline std::string json_fault(const std::exception& e) {
  std::string_view text = e.what();
  if (const auto end = text.find("] "); text.starts_with("[json.exception.") && end != std::string_view::npos)
    text.remove_prefix(end + 2);
  return std::string(text);
}

}  // namespace semvslam
