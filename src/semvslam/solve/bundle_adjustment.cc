#include "semvslam/solve/bundle_adjustment.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "semvslam/solve/schur_sweep.h"

namespace semvslam {
namespace {

constexpr double kFirstLambda = 1e-4, kSmallestLambda = 1e-9, kLargestLambda = 1e8;

// One pass of Levenberg-Marquardt from the present state. A small damping is carried from pass to pass; one that grew
// until nothing moved is not.
void run_pass(SchurSweep& sweep, int iterations, double tolerance, double& lambda, const std::stop_token& stop,
              BaSummary& summary) {
  double cost = sweep.cost();
  lambda = std::min(lambda, kFirstLambda);
  for (int i = 0; i < iterations && !summary.stopped; ++i) {
    ++summary.iterations;
    bool accepted = false;
    double gain = 0;
    while (!accepted && lambda < kLargestLambda) {
      if (stop.stop_requested()) {
        summary.stopped = true;
        return;
      }
      const bool solved = sweep.solve(lambda);
      const double candidate = solved ? sweep.try_step() : cost;
      gain = cost - candidate;
      accepted = solved && gain > 0;
      if (!accepted) {
        // Without a promise of gain beyond rounding, a smaller step cannot help either.
        if (solved && sweep.predicted_gain() < tolerance * cost) return;
        lambda = std::max(lambda, 1e-4) * 10;
      }
    }
    if (!accepted) return;
    sweep.accept_step();
    ++summary.accepted_steps;
    lambda = std::max(lambda * 0.1, kSmallestLambda);
    const bool converged = gain <= tolerance * cost;
    cost -= gain;
    if (converged) return;
  }
}

}  // namespace

std::string BaSummary::brief() const {
  return fmt::format(
      "bundle adjustment: cost {:.6g} -> {:.6g}, {} iterations ({} accepted), {} outlier edges, {:.2f} ms{}{}",
      initial_cost, final_cost, iterations, accepted_steps, outlier_edges, seconds * 1e3, stopped ? ", stopped" : "",
      usable ? "" : ", not usable");
}

BaSummary adjust_bundle(BaProblem& problem, const BaOptions& options, std::vector<std::uint8_t>& edge_inlier,
                        std::stop_token stop) {
  const auto start = std::chrono::steady_clock::now();
  BaSummary summary;
  SchurSweep sweep(problem, options.chi2_pixel, options.chi2_disparity);
  if (sweep.usable()) {
    summary.initial_cost = sweep.cost();
    double lambda = kFirstLambda;
    run_pass(sweep, options.robust_iterations, options.relative_cost_tolerance, lambda, stop, summary);
    sweep.leave_out_outliers();
    if (!summary.stopped)
      run_pass(sweep, options.final_iterations, options.relative_cost_tolerance, lambda, stop, summary);
    summary.final_cost = sweep.cost();
    sweep.classify();
    summary.usable = sweep.write_back(problem);
  } else {
    summary.usable = false;
  }
  summary.outlier_edges = sweep.write_inliers(edge_inlier);
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace semvslam
