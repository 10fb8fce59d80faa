#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "semvslam/base/result.h"

namespace semvslam {

struct CloudPoint {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  // world
  std::array<std::uint8_t, 3> rgb{};
};

/// Binary little-endian PLY: float x y z, uchar red green blue.
std::string format_ply(std::span<const CloudPoint> points);
/// Binary PCD 0.7 of the Point Cloud Library: float x y z, and rgb packed into the bits of a float, as it wants them.
std::string format_pcd(std::span<const CloudPoint> points);

/// Whether a file's name says in which of the two formats it shall be. Errors: neither.
Status check_cloud_name(const std::filesystem::path& file);
/// By the file's name; in one step. Errors: as check_cloud_name(); not writable, disk full.
Status write_cloud(const std::filesystem::path& file, std::span<const CloudPoint> points);

}  // namespace semvslam
