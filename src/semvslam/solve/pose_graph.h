#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "semvslam/geometry/se3.h"

namespace semvslam {

/// Poses and measured relative poses between them: what loop closing adjusts. Plain arrays, no map.
struct PoseGraphProblem {
  struct Edge {
    std::uint32_t a = 0, b = 0;
    SE3 a_from_b;  // measured
    // Inverse covariance of log(measured^-1 * a_from_b), tangent (rho, phi): 1/m^2, 1/rad^2. Symmetric, positive.
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity();
  };
  std::vector<SE3> world_from_pose;
  std::vector<std::uint8_t> fixed;  // 1 = constant; at least one in every connected part, or that part stays as it is
  std::vector<Edge> edges;
};

struct PoseGraphOptions {
  int max_iterations = 30;
  double relative_cost_tolerance = 1e-8;  // ends when an accepted step gains less than this share
  // Corner of a Huber loss on an edge's chi^2; 0: none. For graphs whose loop edges are not all certain.
  double huber_chi2 = 0;
};

struct PoseGraphSummary {
  double initial_cost = 0, final_cost = 0;  // sum of chi^2
  int iterations = 0, accepted_steps = 0;
  bool stopped = false;
  bool usable = true;  // false: nothing was changed (a number not finite, nothing fixed, nothing to move)
};

/// Levenberg-Marquardt on SE(3) with a sparse Cholesky factorisation (Kümmerle et al., g2o, ICRA 2011, for the
/// problem). Poses without a path of edges to a fixed one stay as they are. Deterministic, one thread. Throws
/// std::invalid_argument when indices or array sizes contradict each other.
PoseGraphSummary optimize_pose_graph(PoseGraphProblem& problem, const PoseGraphOptions& options = {},
                                     std::stop_token stop = {});

/// Residual log(measured^-1 * world_from_a^-1 * world_from_b) of an edge and its derivative by the left increment of
/// world_from_b; the derivative by that of world_from_a is the negative.
struct PoseGraphResidual {
  SE3::Tangent value;
  Eigen::Matrix<double, 6, 6> by_b;
};
PoseGraphResidual pose_graph_residual(const SE3& measured_a_from_b, const SE3& world_from_a, const SE3& world_from_b);

}  // namespace semvslam
