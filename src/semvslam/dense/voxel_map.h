#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/dense/point_cloud.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

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

  void add_to(ConfigSchema& schema);
  /// What single values cannot show.
  Status check() const;
};

/// A map of coloured points without what moved: key frames' depth images, fused in cubes (voxels) of the world.
/// Two things keep moving ones out: pixels that are known to move are left out, and a voxel that later (or earlier) key
/// frames look through was not there to stay.
/// Made from poses that are final: integrate() every key frame at the end of a run, or again after a correction.
class VoxelMap {
 public:
  /// @param options must pass check().
  VoxelMap(const Camera& camera, const DenseOptions& options);

  /// Adds a key frame. Depth edges are left out: there the sensor mixes what is before and behind.
  /// @param frame its depth; its colour, or the grey image where there is none.
  /// @param moving CV_8UC1 of the image's size, non-zero = pixel of something that moves; may be empty.
  /// Errors: images of another size than the camera's or of a type that is none, a pose that is not finite; nothing is
  /// added then.
  Status integrate(const RgbdFrame& frame, const cv::Mat& moving, const SE3& world_from_camera);

  /// One point per voxel, the mean of what was measured there, ascending by place: the same map gives the same order.
  std::vector<CloudPoint> points();

  std::size_t frames() const { return views_.size(); }

 private:
  struct Voxel {
    std::uint64_t place;                         // 21 bits each of x, y, z: whole voxels from the origin, 2^20 added
    Eigen::Vector3f position_sum_m, colour_sum;  // position within the voxel; BGR
    std::uint32_t pixels;
    std::uint32_t frames;
    void add(const Voxel& other);  // of the same place
  };
  /// What a key frame says about free space: between the camera and here nothing is.
  struct View {
    Eigen::Matrix3f rotation;  // camera from world
    Eigen::Vector3d centre_m;  // of the camera, world
    cv::Mat free_m;            // CV_32FC1 per block of ideal pixels, nearest depth around it; 0 = not all was measured
  };

  cv::Mat free_space(const cv::Mat& depth_m) const;
  cv::Mat usable_depth(const cv::Mat& depth_m, const cv::Mat& moving) const;
  void collect(const cv::Mat& depth_m, const RgbdFrame& frame, const SE3& world_from_camera);
  static bool is_before(const Voxel& a, const Voxel& b);
  static void add_up(std::vector<Voxel>& voxels);
  static void reduce(std::vector<Voxel>& voxels);
  void merge();
  std::uint32_t count_views_through(const Eigen::Vector3d& point) const;

  Camera camera_;
  DenseOptions options_;
  std::vector<Eigen::Vector2f> rays_;    // per recorded pixel: x / z and y / z
  std::vector<int> block_of_pixel_;      // of View::free_m; -1 = none
  std::vector<Voxel> voxels_, pending_;  // sorted by place; of frames not yet merged into them
  std::vector<View> views_;
};

}  // namespace semvslam
