#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace semvslam {

/// Number of a cube among the smallest of an octree, as OctoMap divides space: 16 bits an axis count whole cubes from
/// the origin, 2^15 added; here with those of x, y and z in turns, so that ascending numbers walk through the tree.
using OctreeCode = std::uint64_t;

/// The axes' halves of the tree hold so many of its smallest cubes each.
inline constexpr int kOctreeReach = 1 << 15;

/// @param cube x, y, z of its corner with the least coordinates, in cubes. @return nothing for one outside the tree.
std::optional<OctreeCode> octree_code(const Eigen::Vector3i& cube);

/// One of the smallest cubes that something is known about.
struct OctreeLeaf {
  OctreeCode code = 0;
  bool occupied = false;
};

/// The two files of OctoMap, of an OcTree with leaves of `side_m`: .bt says of each cube that it is occupied, free or,
/// by leaving it out, unknown; .ot gives the logarithm of the odds as well, here those that OctoMap is certain at.
/// Equal neighbours are put together. @param leaves ascending by code, each once.
std::string format_bt(std::span<const OctreeLeaf> leaves, double side_m);
std::string format_ot(std::span<const OctreeLeaf> leaves, double side_m);

}  // namespace semvslam
