#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/dense/dense_options.h"
#include "semvslam/dense/free_space.h"
#include "semvslam/dense/octree.h"
#include "semvslam/dense/point_cloud.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

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
  /// @param labels CV_8UC1 of the image's size, number of the class that a pixel shows, 0 = none; may be empty.
  /// Errors: images of another size than the camera's or of a type that is none, a pose that is not finite; nothing is
  /// added then.
  Status integrate(const RgbdFrame& frame, const cv::Mat& moving, const SE3& world_from_camera,
                   const cv::Mat& labels = {});

  /// One point per voxel, the mean of what was measured there, with the label (or none) that most key frames saw there;
  /// ascending by place: the same map gives the same order.
  std::vector<CloudPoint> points();

  /// The same as the leaves of an octree of `octree_m`: occupied where one of the points is, free where there is none
  /// and a key frame saw through, ascending by code. @param points of this map as points() gave them.
  std::vector<OctreeLeaf> octree(std::span<const CloudPoint> points) const;

  std::size_t frames() const { return free_.views(); }

 private:
  struct Voxel {
    std::uint64_t key;  // 18 bits each of x, y, z: whole voxels from the origin, 2^17 added; 8 bits of the label
    Eigen::Vector3f position_sum_m, colour_sum;  // position within the voxel; BGR
    std::uint32_t pixels;
    std::uint32_t frames;
    void add(const Voxel& other);  // of the same place
  };
  using Voxels = std::vector<Voxel>;

  cv::Mat usable_depth(const cv::Mat& depth_m, const cv::Mat& moving) const;
  void collect(const cv::Mat& depth_m, const RgbdFrame& frame, const SE3& world_from_camera, const cv::Mat& labels);
  static bool is_before(const Voxel& a, const Voxel& b);
  static void add_up(Voxels& voxels);
  static void reduce(Voxels& voxels);
  static Voxel next_place(Voxels::const_iterator& from, Voxels::const_iterator end, std::uint32_t Voxel::*votes);
  void merge();

  Camera camera_;
  DenseOptions options_;
  std::vector<Eigen::Vector2f> rays_;  // per recorded pixel: x / z and y / z
  Voxels voxels_, pending_;            // sorted by key; of frames not yet merged into them
  FreeSpace free_;
};

}  // namespace semvslam
