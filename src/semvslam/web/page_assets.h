#pragma once

#include <span>
#include <string_view>

namespace semvslam {

/// A file of the folder page/, a part of the program.
struct PageAsset {
  std::string_view name, text;
};

std::string_view page_template();
std::string_view page_style();
/// In the order in which they stand in the page.
std::span<const PageAsset> page_scripts();

}  // namespace semvslam
