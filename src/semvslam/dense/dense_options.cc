#include "semvslam/dense/dense_options.h"

#include <fmt/core.h>

namespace semvslam {

void DenseOptions::add_to(ConfigSchema& schema) {
  schema.add("dense.voxel_m", &voxel_m, {0.001, 1}, "side of the cubes that the dense map's points are averaged in, m");
  schema.add("dense.min_depth_m", &min_depth_m, {0, 100}, "nearer depth does not get into it, m");
  schema.add("dense.max_depth_m", &max_depth_m, {0.1, 1000}, "farther depth does not get into it, m");
  schema.add("dense.edge_share", &edge_share, {0.001, 10},
             "a larger step to a neighbouring pixel is a depth edge, which is left out, share of the depth");
  schema.add("dense.margin_px", &margin_px, {0, 100}, "so much around what moves is left out, px");
  schema.add("dense.least_frames", &least_frames, {1, 1000}, "key frames that must have measured a point");
  schema.add("dense.seen_through", &seen_through, {1, 100000},
             "a point goes when so many key frames look through it ...");
  schema.add("dense.seen_through_share", &seen_through_share, {0, 1000}, "... and so many for each that measured it");
  schema.add("dense.free_margin_m", &free_margin_m, {0, 10},
             "looking through: depth behind the point by this at least, m");
  schema.add("dense.free_share", &free_share, {0, 1}, "and by this share of its depth more");
  schema.add("dense.octree_m", &octree_m, {0.005, 10},
             "side of the octree's smallest cubes, m; free ones are marked up to 200 of them away from a camera");
}

Status DenseOptions::check() const {
  if (min_depth_m < max_depth_m) return Status::success();
  return Error{ErrorCode::kInvalidInput,
               fmt::format("dense.min_depth_m = {} is not less than dense.max_depth_m = {}", min_depth_m, max_depth_m)};
}

}  // namespace semvslam
