#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace semvslam {

/// RFC 4648, with padding.
std::string base64(std::span<const std::uint8_t> bytes);

/// Numbers as base64 of their bytes, little-endian: what a typed array of JavaScript takes.
std::string packed(std::span<const float> numbers);
std::string packed(std::span<const std::uint16_t> numbers);

/// Points on a grid of 65536 steps along each axis of the box around them: position = origin + step * grid.
struct QuantisedPoints {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero(), step_m = Eigen::Vector3d::Zero();
  std::vector<std::uint16_t> grid;  // x y z x y z ...
};

/// Each coordinate is at most half a step off. @param points_m finite
QuantisedPoints quantised(std::span<const Eigen::Vector3f> points_m);

}  // namespace semvslam
