#pragma once

#include "semvslam/base/config_schema.h"
#include "semvslam/base/result.h"

namespace semvslam {

struct DenseOptions {
  double voxel_m = 0.01;                        // side of the cubes that points are averaged in
  double min_depth_m = 0.3, max_depth_m = 4.0;  // measurements beyond are not used
  double edge_share = 0.03;                     // of the depth: a larger step to a neighbouring pixel is an edge
  int margin_px = 6;                            // kept clear around what moves
  int least_frames = 1;                         // key frames that must have measured a voxel
  int seen_through = 2;                         // key frames that must have looked through one that goes, ...
  double seen_through_share = 0.5;              // ... and as a share of those that measured it
  double free_margin_m = 0.03,
         free_share = 0.02;  // a measurement is behind a voxel by more than this, and of its depth
  double octree_m = 0.05;    // side of the octree's smallest cubes

  void add_to(ConfigSchema& schema);
  /// What single values cannot show.
  Status check() const;
};

}  // namespace semvslam
