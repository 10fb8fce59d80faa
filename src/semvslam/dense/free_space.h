#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/dense/dense_options.h"
#include "semvslam/dense/octree.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// What key frames have seen to be empty: between a camera and what it measured nothing is, not even in front of what
/// moves.
class FreeSpace {
 public:
  /// @param options must pass check().
  FreeSpace(const Camera& camera, const DenseOptions& options);

  /// @param depth_m CV_32FC1 of the camera's size, 0 = not measured.
  void add(const cv::Mat& depth_m, const SE3& world_from_camera);

  /// Key frames that measured something behind a point of the world, by more than the margins of the options.
  std::uint32_t count_views_through(const Eigen::Vector3d& point) const;

  /// The smallest cubes of an octree of `octree_m` that a key frame looked through: its ray to the cube's middle goes
  /// on beyond it by half a side at least. Ascending. Takes time with the cubes in view, whatever the pixels; as far as
  /// max_depth_m, at most 200 cubes away from a camera.
  std::vector<OctreeCode> octree_cubes() const;

  std::size_t views() const { return views_.size(); }

 private:
  struct View {
    Eigen::Matrix3f rotation;  // camera from world
    Eigen::Vector3d centre_m;  // of the camera, world
    cv::Mat free_m;            // CV_32FC1 per block of ideal pixels, nearest depth around it; 0 = not all was measured
  };
  class Cubes;

  float free_depth_m(const View& view, const Eigen::Vector3f& point) const;
  void mark_cubes(const View& view, Cubes& cubes) const;
  void mark_row(const View& view, const Eigen::Affine3d& camera_from_cube, const Eigen::Vector3i& first, int last_x,
                Cubes& cubes) const;

  DenseOptions options_;
  Eigen::Array2f focal_px_, centre_px_;  // ideal; from the corner of the image
  std::vector<int> block_of_pixel_;      // of View::free_m; -1 = none
  std::vector<View> views_;
};

}  // namespace semvslam
