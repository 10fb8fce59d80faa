#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "semvslam/solve/bundle_adjustment.h"
#include "semvslam/solve/edge_blocks.h"
#include "semvslam/solve/reduced_system.h"

namespace semvslam {

/// The inside of adjust_bundle(): state, robust normal equations and their solution by the Schur complement (Triggs et
/// al., 2000, section 6.1). Every sum has a fixed order.
class SchurSweep {
 public:
  /// Copies the problem. Throws std::invalid_argument when its arrays contradict each other.
  /// @param pixel_limit, disparity_limit corners of the Huber losses and limits of the inliers, chi^2.
  SchurSweep(const BaProblem& problem, double pixel_limit, double disparity_limit);

  /// False when there is nothing that could be adjusted: camera or a pose not finite, no fixed pose, no usable edge.
  bool usable() const { return usable_; }
  /// Robust cost of the active edges at the present state.
  double cost() const { return edges_->cost(matrices_, points_); }
  /// Computes a damped step. @return false when the system is singular.
  bool solve(double lambda);
  /// Cost after the step of solve(); the state stays.
  double try_step();
  /// What the linear model promised for the step; known after try_step().
  double predicted_gain() const { return predicted_gain_; }
  void accept_step();
  /// Decides from the residuals at the present state which measurements are inliers.
  void classify() { edges_->classify(matrices_, points_); }
  /// classify(), then also leaves out what no longer determines its point.
  void leave_out_outliers();
  /// @return false, and nothing is written, when the state is not finite.
  bool write_back(BaProblem& problem) const;
  /// 1 per edge whose pixel is an inlier at the last classify(). @return number of others.
  int write_inliers(std::vector<std::uint8_t>& edge_inlier) const { return edges_->write_inliers(edge_inlier); }

 private:
  // Cholesky factor of a point's damped 3x3 block, and y = L^-1 g.
  struct Factor {
    double inverse_l00 = 0, l10 = 0, inverse_l11 = 0, l20 = 0, l21 = 0, inverse_l22 = 0;
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    bool moves = false;  // false: not positive definite, the point stays
    void compute(const PointNormal& normal, double lambda);
  };

  void mark_pairs();
  void add_pose_blocks(double lambda);
  void eliminate_point(std::size_t point, double lambda);
  Eigen::Vector3d substitute_back(std::size_t point) const;

  bool usable_ = false;
  std::vector<SE3> poses_, candidate_poses_;
  std::vector<PoseMatrix> matrices_, candidate_matrices_;
  std::vector<std::uint32_t> free_poses_;  // free index -> pose
  std::vector<Eigen::Vector3d> points_, candidate_points_;
  std::optional<EdgeBlocks> edges_;
  std::vector<PoseNormal> pose_normals_;
  std::vector<PointNormal> point_normals_;
  std::vector<Columns3> couplings_;  // per slot: W, after the elimination Z = W L^-T
  std::vector<Factor> factors_;
  std::optional<ReducedSystem> reduced_;
  std::vector<Lanes> pose_steps_;
  double lambda_ = 0, predicted_gain_ = 0;
};

}  // namespace semvslam
