#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace semvslam::testing_support {

/// Some bytes as they lie in memory.
template <typename T>
std::string raw(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

/// A PLY file as `semvslam run` writes its landmarks.
inline std::string landmark_ply(const std::vector<Eigen::Vector3f>& points) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment landmarks, metres\nelement vertex " +
                    std::to_string(points.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (const Eigen::Vector3f& p : points)
    for (const float coordinate : p) out += raw(coordinate);
  return out;
}

}  // namespace semvslam::testing_support
