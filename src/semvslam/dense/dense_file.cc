#include "semvslam/dense/dense_file.h"

#include <fmt/core.h>

#include <span>
#include <string>

#include "semvslam/data/file_io.h"

namespace semvslam {
namespace {

std::string format_points(DenseFormat format, std::span<const CloudPoint> points, const DenseMap& map) {
  return format == DenseFormat::kPly ? format_ply(points, map.labels) : format_pcd(points, map.labels);
}

std::string format_octree(DenseFormat format, const DenseMap& map) {
  return format == DenseFormat::kBt ? format_bt(map.leaves, map.leaf_m) : format_ot(map.leaves, map.leaf_m);
}

}  // namespace

Result<DenseFormat> dense_format(const std::filesystem::path& file) {
  const std::filesystem::path extension = file.extension();
  if (extension == ".ply") return DenseFormat::kPly;
  if (extension == ".pcd") return DenseFormat::kPcd;
  if (extension == ".bt") return DenseFormat::kBt;
  if (extension == ".ot") return DenseFormat::kOt;
  return Error{
      ErrorCode::kInvalidInput,
      fmt::format("{}: a dense map's name says what it holds: points end in .ply or .pcd, an octree in .bt or .ot",
                  file.string())};
}

Status write_dense_map(const std::filesystem::path& file, const DenseMap& map) {
  const Result<DenseFormat> format = dense_format(file);
  if (!format) return format.error();
  if (is_octree(*format)) return write_file_atomically(file, format_octree(*format, map));
  const bool by_label = file.stem().extension() == ".labels";
  return write_file_atomically(file, by_label ? format_points(*format, coloured_by_label(map.points), map)
                                              : format_points(*format, map.points, map));
}

}  // namespace semvslam
