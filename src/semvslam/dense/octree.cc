#include "semvslam/dense/octree.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace semvslam {
namespace {

static_assert(std::endian::native == std::endian::little, "octrees are written in the machine's byte order");

constexpr int kHeight = 16;  // steps from the tree's root to its smallest cubes

using Leaves = std::span<const OctreeLeaf>;

/// What a file says of a cube: the two bits of it in .bt.
enum class Cube : std::uint16_t { kUnknown = 0, kFree = 1, kOccupied = 2, kDivided = 3 };

bool is_occupied(const OctreeLeaf& leaf) { return leaf.occupied; }

/// @param leaves all that are known in a cube of 2^height of the smallest a side.
Cube cube_of(Leaves leaves, int height) {
  if (leaves.empty()) return Cube::kUnknown;
  if (leaves.size() < std::size_t{1} << 3 * height) return Cube::kDivided;
  if (std::ranges::all_of(leaves, is_occupied)) return Cube::kOccupied;
  return std::ranges::none_of(leaves, is_occupied) ? Cube::kFree : Cube::kDivided;
}

/// The leaves in each eighth of a cube of that height.
std::array<Leaves, 8> eighths(Leaves leaves, int height) {
  std::array<Leaves, 8> out;
  const auto eighth = [&](const OctreeLeaf& leaf) { return leaf.code >> 3 * (height - 1) & 7; };
  for (std::size_t k = 0; k < 8; ++k) {
    const auto end = std::ranges::partition_point(leaves, [&](const OctreeLeaf& l) { return eighth(l) <= k; });
    out[k] = {leaves.begin(), end};
    leaves = {end, leaves.end()};
  }
  return out;
}

struct Nodes {
  std::string data;
  std::size_t count = 0;

  template <typename Value>
  void put(Value value) {
    const auto bytes = std::bit_cast<std::array<char, sizeof value>>(value);
    data.append(bytes.data(), bytes.size());
  }
};

/// A divided cube: two bits for each eighth, then those of them that are divided themselves.
void put_binary(Leaves leaves, int height, Nodes& nodes) {
  ++nodes.count;
  const std::array<Leaves, 8> parts = eighths(leaves, height);
  std::uint16_t bits = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    const Cube cube = cube_of(parts[k], height - 1);
    bits = static_cast<std::uint16_t>(bits | static_cast<std::uint16_t>(cube) << 2 * k);
    nodes.count += cube == Cube::kFree || cube == Cube::kOccupied;
  }
  nodes.put(bits);
  for (std::size_t k = 0; k < 8; ++k)
    if (cube_of(parts[k], height - 1) == Cube::kDivided) put_binary(parts[k], height - 1, nodes);
}

float log_odds(double probability) { return static_cast<float>(std::log(probability / (1 - probability))); }

/// Any known cube: its log odds (the highest in it), a bit for each known eighth, and those.
void put_log_odds(Leaves leaves, int height, Nodes& nodes) {
  ++nodes.count;
  // Beyond these probabilities OctoMap does not go.
  nodes.put(std::ranges::any_of(leaves, is_occupied) ? log_odds(.971) : log_odds(.1192));
  if (cube_of(leaves, height) != Cube::kDivided) return nodes.put(std::uint8_t{0});
  const std::array<Leaves, 8> parts = eighths(leaves, height);
  std::uint8_t known = 0;
  for (std::size_t k = 0; k < 8; ++k) known = static_cast<std::uint8_t>(known | !parts[k].empty() << k);
  nodes.put(known);
  for (const Leaves& part : parts)
    if (!part.empty()) put_log_odds(part, height - 1, nodes);
}

std::string format(const char* first_line, Leaves leaves, double side_m, void (*put)(Leaves, int, Nodes&)) {
  Nodes nodes;
  if (!leaves.empty()) put(leaves, kHeight, nodes);
  return fmt::format("{}\n# dense map, metres\nid OcTree\nsize {}\nres {}\ndata\n", first_line, nodes.count, side_m) +
         nodes.data;
}

}  // namespace

std::optional<OctreeCode> octree_code(const Eigen::Vector3i& cube) {
  OctreeCode code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (cube[axis] < -kOctreeReach || cube[axis] >= kOctreeReach) return std::nullopt;
    const auto number = static_cast<OctreeCode>(cube[axis] + kOctreeReach);
    for (int bit = 0; bit < kHeight; ++bit) code |= (number >> bit & 1) << (3 * bit + axis);
  }
  return code;
}

std::string format_bt(Leaves leaves, double side_m) {
  return format("# Octomap OcTree binary file", leaves, side_m, put_binary);
}

std::string format_ot(Leaves leaves, double side_m) {
  return format("# Octomap OcTree file", leaves, side_m, put_log_odds);
}

}  // namespace semvslam
