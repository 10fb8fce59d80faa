#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace semvslam::testing_support {

inline std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace semvslam::testing_support
