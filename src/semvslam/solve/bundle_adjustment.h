#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "semvslam/geometry/se3.h"
#include "semvslam/solve/observation.h"

namespace semvslam {

/// What to optimise: plain arrays, no map. Poses are camera_from_world; indices refer to the arrays here.
struct BaProblem {
  struct Edge {
    std::uint32_t pose = 0, point = 0;
    PointObservation observation;
  };
  Intrinsics camera;
  std::vector<SE3> poses;
  std::vector<std::uint8_t> pose_fixed;  // 1 = constant; at least one must be, or the gauge floats
  std::vector<Eigen::Vector3d> points;   // world, metres
  std::vector<Edge> edges;               // any order; a (pose, point) pair at most once
};

struct BaOptions {
  int robust_iterations = 5;  // first pass, Huber loss
  int final_iterations = 5;   // second pass, edges over the chi^2 limits left out
  double chi2_pixel = 5.991;
  double chi2_disparity = 3.841;
  double relative_cost_tolerance = 1e-4;  // a pass ends when an accepted step gains less than this share
};

struct BaSummary {
  double initial_cost = 0, final_cost = 0;
  int iterations = 0, accepted_steps = 0;
  int outlier_edges = 0;
  bool stopped = false;  // by the stop token: the state is the best so far
  bool usable = true;    // false: numerically impossible, nothing was changed
  double seconds = 0;
  std::string brief() const;
};

/// Levenberg-Marquardt on poses and points with the points eliminated by the Schur complement (Triggs et al., 2000,
/// section 6.1; Lourakis & Argyros, SBA, 2009). The reduced system is solved by a dense Cholesky factorisation for up
/// to 64 free poses, beyond that by a sparse one when few pairs of poses see points together. Observations and points
/// that are not finite are left out, as are points that one pixel without depth does not fix; poses without edges stay.
/// Throws std::invalid_argument when indices or array sizes contradict each other.
/// @param problem poses and points are overwritten with the result.
/// @param edge_inlier resized to edges.size(): 1 where the pixel residual passes at the solution (where the numbers can
/// be
///        used at all, when the summary says that the problem is not usable).
/// Deterministic: fixed order of summation, whatever the order of the edges; one thread.
BaSummary adjust_bundle(BaProblem& problem, const BaOptions& options, std::vector<std::uint8_t>& edge_inlier,
                        std::stop_token stop = {});

}  // namespace semvslam
