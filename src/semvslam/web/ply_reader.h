#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <istream>
#include <string>

#include "semvslam/base/result.h"

namespace semvslam {

struct PlyVertex {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  // as in the file: may be NaN or infinite
  std::array<std::uint8_t, 3> rgb{};                     // 0 where the file has no colours
};

/// What a PLY file says of itself.
struct PlyHeader {
  std::size_t vertices = 0;
  bool has_colours = false;
};

using PlyVisitor = std::function<void(const PlyVertex&)>;

/// Calls `visit` for every vertex of a binary little-endian PLY file; some kilobytes of it are in memory at a time.
/// x, y, z are float or double, red, green, blue uchar where they are there, other scalars are passed over; elements
/// after the vertices are not read. Errors: another kind of PLY, no PLY at all, a header that promises more than the
/// file holds. @param name of the file, for messages.
Result<PlyHeader> read_ply(std::istream& in, const std::string& name, const PlyVisitor& visit);

/// The same of a file. Errors: also missing, unreadable.
Result<PlyHeader> read_ply(const std::filesystem::path& file, const PlyVisitor& visit);

}  // namespace semvslam
