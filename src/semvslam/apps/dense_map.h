#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/sequence.h"
#include "semvslam/dense/voxel_map.h"
#include "semvslam/pipeline/slam.h"

namespace semvslam {

struct DenseMapSummary {
  std::filesystem::path file;
  std::size_t points = 0, key_frames = 0;
  std::size_t absent = 0;  // key frames whose images could not be read again
  double seconds = 0;
};

/// Fuses a recording's key frames, whose images are read once more, and writes the cloud.
/// @param key_frames their poses, by time. @param masks of what moves in them, in the same order.
/// Errors: as open_sequence(), VoxelMap::integrate() and write_cloud().
Result<DenseMapSummary> make_dense_map(const std::filesystem::path& sequence, SequenceOptions sequence_options,
                                       const Trajectory& key_frames, const std::vector<KeyFrameMask>& masks,
                                       const DenseOptions& options, const std::filesystem::path& file);
/// One line for the terminal.
std::string format_summary(const DenseMapSummary& summary);

}  // namespace semvslam
