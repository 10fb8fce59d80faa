#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "semvslam/solve/bundle_adjustment.h"
#include "semvslam/solve/lanes.h"
#include "semvslam/solve/residuals.h"

namespace semvslam {

/// A pose in the form that moves points fastest.
struct PoseMatrix {
  Eigen::Matrix3d r;
  Eigen::Vector3d t;
  explicit PoseMatrix(const SE3& pose) : r(pose.rotation_matrix()), t(pose.translation()) {}
};

/// Normal equations of one free pose: upper triangle of H row by row, then g.
using PoseNormal = std::array<double, kPoseEntries + 6>;
/// Normal equations of one point: upper triangle of H (xx xy xz yy yz zz), then g.
using PointNormal = std::array<double, 9>;
/// Columns of a matrix with six rows, two rows of padding.
using Columns3 = std::array<Lanes, 3>;

/// The edges of a bundle adjustment sorted by point, inside a point by pose, eight to a block, with one lane per edge.
/// Edges to free poses have a slot, counted in the same order; a point's slots are neighbours.
class EdgeBlocks {
 public:
  static constexpr std::uint32_t kNoSlot = 0xffffffffu;

  /// Throws std::invalid_argument when a point has two edges to one pose.
  /// @param points those that are not finite are set to zero here and have no active edges.
  EdgeBlocks(const BaProblem& problem, std::vector<Eigen::Vector3d>& points, double pixel_limit,
             double disparity_limit);

  bool any_active() const;
  std::size_t slots() const { return slot_pose_.size(); }
  /// First slot of a point; that of the next point ends its slots.
  std::uint32_t slot_begin(std::size_t point) const { return slot_begin_[point]; }
  /// Index of the slot's pose among the free ones; ascending inside a point.
  std::uint32_t slot_pose(std::size_t slot) const { return slot_pose_[slot]; }

  /// Robust cost of the active measurements.
  double cost(const std::vector<PoseMatrix>& poses, const std::vector<Eigen::Vector3d>& points) const;
  /// Robust normal equations of the active measurements; the outputs must have their sizes and are overwritten.
  /// @param coupling per slot: W, the mixed block (pose, point).
  void linearize(const std::vector<PoseMatrix>& poses, const std::vector<Eigen::Vector3d>& points,
                 std::vector<PoseNormal>& pose_normals, std::vector<PointNormal>& point_normals,
                 std::vector<Columns3>& coupling) const;
  /// Decides from the residuals which measurements are inliers; those are active from now on.
  void classify(const std::vector<PoseMatrix>& poses, const std::vector<Eigen::Vector3d>& points);
  /// One pixel without depth does not fix a point: such a point follows nothing and must not pull its pose.
  void switch_off_weak_points();
  /// 1 per edge of the problem whose pixel is active. @return number of others.
  int write_inliers(std::vector<std::uint8_t>& edge_inlier) const;

 private:
  struct Block {
    Lanes u{}, v{}, disparity{};
    Lanes pixel_variance_inverse{}, disparity_variance_inverse{};  // of usable measurements, else 0
    Lanes pixel_weight{}, disparity_weight{};                      // the same while active, else 0
    std::array<std::uint32_t, kLanes> pose{}, point{}, slot{}, original{};
  };
  struct View {  // of one block: points in the camera frames
    Lanes r[3][3], x, y, z;
    Lanes in_front_z;  // z, or 1 where the point cannot be seen
    Lanes visible;     // 1 or 0
  };
  static View view(const Block& b, const std::vector<PoseMatrix>& poses, const std::vector<Eigen::Vector3d>& points);
  static void set_observation(Block& b, std::size_t lane, const PointObservation& o);

  Intrinsics camera_;
  double pixel_limit_, disparity_limit_;
  std::size_t edges_ = 0;
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> slot_begin_, slot_pose_;
};

}  // namespace semvslam
