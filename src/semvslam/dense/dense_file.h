#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/dense/octree.h"
#include "semvslam/dense/point_cloud.h"

namespace semvslam {

/// What VoxelMap gives, as it is written.
struct DenseMap {
  std::vector<CloudPoint> points;
  std::optional<LabelNames> labels;  // of the points; empty where none were given
  std::vector<OctreeLeaf> leaves;
  double leaf_m = 0;  // side of the leaves
};

enum class DenseFormat { kPly, kPcd, kBt, kOt };
inline bool is_octree(DenseFormat format) { return format == DenseFormat::kBt || format == DenseFormat::kOt; }

/// What a file of that name shall hold. Points in a file .labels.ply or .labels.pcd are coloured by label. Errors: the
/// name does not say it.
Result<DenseFormat> dense_format(const std::filesystem::path& file);
/// Points or octree, by the file's name; in one step. Errors: as dense_format(); not writable, disk full.
Status write_dense_map(const std::filesystem::path& file, const DenseMap& map);

}  // namespace semvslam
