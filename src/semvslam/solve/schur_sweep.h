#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "semvslam/solve/bundle_adjustment.h"
#include "semvslam/solve/lanes.h"
#include "semvslam/solve/residuals.h"

namespace semvslam {

/// The inside of adjust_bundle(): state, robust normal equations and their solution by the Schur complement (Triggs et
/// al., 2000, section 6.1). Works in two sweeps over the points, each touching a point's edges once while they are in
/// cache: solve() linearises and eliminates, try_step() substitutes back, moves and evaluates. Every sum has a fixed
/// order.
class SchurSweep {
 public:
  /// Copies the problem. Throws std::invalid_argument when its arrays contradict each other.
  /// @param pixel_limit, disparity_limit corners of the Huber losses and limits of the inliers, chi^2.
  SchurSweep(const BaProblem& problem, double pixel_limit, double disparity_limit);

  /// False when there is nothing that could be adjusted: camera or a pose not finite, no fixed pose, no usable edge.
  bool usable() const { return usable_; }
  /// Robust cost of the active edges at the present state.
  double cost() const;
  /// Computes a damped step. @return false when the system is singular.
  bool solve(double lambda);
  /// Cost after the step of solve(); the state stays.
  double try_step();
  /// What the linear model promised for the step; known after try_step().
  double predicted_gain() const { return predicted_gain_; }
  void accept_step();
  /// Decides from the residuals at the present state which measurements are inliers.
  void classify();
  /// classify(), then also leaves out what no longer determines its point.
  void leave_out_outliers();
  /// @return false, and nothing is written, when the state is not finite.
  bool write_back(BaProblem& problem) const;
  /// 1 per edge whose pixel is an inlier at the last classify(). @return number of others.
  int write_inliers(std::vector<std::uint8_t>& edge_inlier) const;

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  // Columns of matrices with six rows; two rows of padding.
  using Columns3 = std::array<Lanes, 3>;
  using Columns6 = std::array<Lanes, 6>;

  struct PoseMatrix {
    Eigen::Matrix3d r;
    Eigen::Vector3d t;
    explicit PoseMatrix(const SE3& pose) : r(pose.rotation_matrix()), t(pose.translation()) {}
  };
  struct Edge {
    std::uint32_t pose = 0;
    std::int32_t free = -1;  // index among the free poses, -1 when the pose is fixed
    double u = 0, v = 0, disparity = 0;
    double pixel_variance_inverse = 0, disparity_variance_inverse = 0;  // 0: not usable
    double pixel_weight = 0, disparity_weight = 0;                      // the same while active, else 0
    std::uint32_t original = 0;                                         // index in BaProblem::edges
  };
  struct PoseNormal {
    double h[kPoseEntries];
    double g[6];
  };
  // What back-substitution needs of an edge: W^T x = N^T (rho + phi x p), N = M R.
  struct Coupling {
    Eigen::Vector3d p;
    Eigen::Matrix3d n;
  };
  // Cholesky factor of a point's damped 3x3 block, and y = L^-1 g.
  struct Eliminated {
    double inverse_l00 = 0, l10 = 0, inverse_l11 = 0, l20 = 0, l21 = 0, inverse_l22 = 0;
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    Eigen::Vector3d diagonal = Eigen::Vector3d::Zero();  // before damping
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    bool moves = false;
    bool factor(const Eigen::Matrix3d& h, double lambda);
  };

  void load(const BaProblem& problem);
  void switch_off_weak_points();
  double edge_cost(const Edge& e, const Eigen::Vector3d& p) const;
  void eliminate_point(std::size_t point, double lambda);
  void subtract_schur(const Eliminated& el, std::size_t count);
  bool solve_reduced(double lambda);
  Eigen::Vector3d substitute_back(std::size_t point) const;

  Intrinsics camera_;
  double pixel_limit_, disparity_limit_;
  bool usable_ = false;
  std::vector<SE3> poses_, candidate_poses_;
  std::vector<PoseMatrix> matrices_, candidate_matrices_;
  std::vector<std::uint32_t> free_poses_;  // free index -> pose
  std::vector<Eigen::Vector3d> points_, candidate_points_;
  std::vector<std::uint32_t> edge_begin_;  // of each point, and the end
  std::vector<Edge> edges_;                // by point, then by pose
  std::vector<PoseNormal> pose_normals_;
  std::vector<Coupling> couplings_;  // per edge, those of free poses only are used
  std::vector<Eliminated> eliminated_;
  std::vector<Columns3> z_;            // of the point at hand: W L^-T per free edge
  std::vector<std::uint32_t> z_pose_;  // and its free pose, ascending
  std::vector<Columns6> schur_;        // sums of Z Z^T: block (a, b), a >= b, at a (a + 1) / 2 + b
  std::vector<Lanes> schur_rhs_;       // sums of Z y
  Eigen::MatrixXd reduced_;            // lower triangle
  Eigen::VectorXd reduced_rhs_, pose_step_;
  double lambda_ = 0, predicted_gain_ = 0;
};

}  // namespace semvslam
