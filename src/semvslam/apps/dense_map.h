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
  std::vector<std::filesystem::path> files;
  std::size_t points = 0, key_frames = 0;
  std::size_t occupied = 0, free = 0;  // leaves of the octree; none where no file is one
  std::size_t absent = 0;              // key frames whose images could not be read again
  double seconds = 0;
};

/// Fuses a recording's key frames, whose images are read once more, and writes the map to each of the files.
/// @param key_frames their poses, by time. @param masks of what moves and what is to be seen in them, in the same
/// order.
/// Errors: as open_sequence(), VoxelMap::integrate() and write_dense_map(); a file that cannot be written does not keep
/// the others from it.
Result<DenseMapSummary> make_dense_map(const std::filesystem::path& sequence, SequenceOptions sequence_options,
                                       const Trajectory& key_frames, const std::vector<KeyFrameMask>& masks,
                                       const DenseOptions& options, const std::vector<std::filesystem::path>& files);
/// Lines for the terminal.
std::string format_summary(const DenseMapSummary& summary);

}  // namespace semvslam
