#include "semvslam/dense/point_cloud.h"

#include <fmt/core.h>

#include <bit>
#include <cstring>

#include "semvslam/data/file_io.h"

namespace semvslam {
namespace {

static_assert(std::endian::native == std::endian::little, "clouds are written in the machine's byte order");

/// The header, and after it what `pack` writes of each point to its record.
template <typename Pack>
std::string records(std::string header, std::span<const CloudPoint> points, std::size_t record_bytes,
                    const Pack& pack) {
  const std::size_t begin = header.size();
  header.resize(begin + points.size() * record_bytes);
  char* to = header.data() + begin;
  for (const CloudPoint& p : points) {
    std::memcpy(to, p.position_m.data(), 3 * sizeof(float));
    pack(p, to + 3 * sizeof(float));
    to += record_bytes;
  }
  return header;
}

}  // namespace

std::string format_ply(std::span<const CloudPoint> points) {
  return records(fmt::format("ply\nformat binary_little_endian 1.0\ncomment dense map, metres\nelement vertex {}\n"
                             "property float x\nproperty float y\nproperty float z\nproperty uchar red\n"
                             "property uchar green\nproperty uchar blue\nend_header\n",
                             points.size()),
                 points, 3 * sizeof(float) + 3,
                 [](const CloudPoint& p, char* to) { std::memcpy(to, p.rgb.data(), p.rgb.size()); });
}

std::string format_pcd(std::span<const CloudPoint> points) {
  return records(fmt::format("# .PCD v0.7 - dense map, metres\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\n"
                             "TYPE F F F F\nCOUNT 1 1 1 1\nWIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\n"
                             "DATA binary\n",
                             points.size()),
                 points, 4 * sizeof(float), [](const CloudPoint& p, char* to) {
                   const std::uint32_t packed = static_cast<std::uint32_t>(p.rgb[0]) << 16 |
                                                static_cast<std::uint32_t>(p.rgb[1]) << 8 | p.rgb[2];
                   std::memcpy(to, &packed, sizeof packed);
                 });
}

Status check_cloud_name(const std::filesystem::path& file) {
  if (file.extension() == ".ply" || file.extension() == ".pcd") return Status::success();
  return Error{ErrorCode::kInvalidInput,
               fmt::format("{}: a point cloud's name ends in .ply or .pcd, which says its format", file.string())};
}

Status write_cloud(const std::filesystem::path& file, std::span<const CloudPoint> points) {
  if (Status status = check_cloud_name(file); !status) return status;
  return write_file_atomically(file, file.extension() == ".ply" ? format_ply(points) : format_pcd(points));
}

}  // namespace semvslam
