#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace semvslam {

struct CloudPoint {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  // world
  std::array<std::uint8_t, 3> rgb{};
  std::uint8_t label = 0;  // number of its class; 0 = none
};

/// The classes of labels.
using LabelNames = std::map<std::uint8_t, std::string>;

/// Binary little-endian PLY: float x y z, uchar red green blue; uchar label where there are names for labels, which
/// then stand in comments.
std::string format_ply(std::span<const CloudPoint> points, const std::optional<LabelNames>& names = {});
/// Binary PCD 0.7 of the Point Cloud Library: float x y z, and rgb packed into the bits of a float, as it wants them;
/// label of 32 bits like format_ply().
std::string format_pcd(std::span<const CloudPoint> points, const std::optional<LabelNames>& names = {});

/// The points with a colour for each label; those of none in shades of grey.
std::vector<CloudPoint> coloured_by_label(std::span<const CloudPoint> points);

}  // namespace semvslam
