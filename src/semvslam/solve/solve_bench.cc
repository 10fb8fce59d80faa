#include <benchmark/benchmark.h>

#include "semvslam/solve/bundle_adjustment.h"
#include "semvslam/solve/bundle_adjustment_ceres.h"
#include "semvslam/solve/pose_optimizer.h"
#include "semvslam/solve/synthetic_bundle.h"

namespace semvslam {
namespace {

void bm_optimize_pose(benchmark::State& state) {
  synthetic::BundleOptions o;
  o.points = static_cast<int>(state.range(0));
  o.outlier_share = 0.1;
  o.depth_outlier_share = 0.1;
  const synthetic::View view = synthetic::make_view(o);
  SE3::Tangent error;
  error << 0.02, -0.01, 0.02, 0.01, -0.02, 0.01;
  const SE3 initial = SE3::exp(error) * view.truth;
  std::vector<std::uint8_t> inlier;
  int inliers = 0;
  for (auto _ : state) {
    const PoseEstimate e =
        optimize_pose(Intrinsics::of(synthetic::vga_camera()), initial, view.points, view.observations, {}, inlier);
    benchmark::DoNotOptimize(inliers = e.inliers);
  }
  state.counters["observations"] = static_cast<double>(view.points.size());
  state.counters["inliers"] = inliers;
}
BENCHMARK(bm_optimize_pose)->Arg(200)->Arg(700)->Unit(benchmark::kMicrosecond);

synthetic::Bundle local_bundle(int poses, int fixed, int points) {
  synthetic::BundleOptions o;
  o.poses = poses;
  o.fixed = fixed;
  o.points = points;
  o.edges_per_point = 8;
  o.outlier_share = 0.03;
  o.depth_outlier_share = 0.05;
  return synthetic::make_bundle(o);
}

// The local map of tracking a room (12 free key frames), and a larger one.
template <typename Solver>
void run_bundle(benchmark::State& state, Solver solver) {
  const synthetic::Bundle bundle = local_bundle(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)),
                                                static_cast<int>(state.range(2)));
  std::vector<std::uint8_t> inlier;
  BaSummary summary;
  for (auto _ : state) {
    BaProblem problem = bundle.problem;
    summary = solver(problem, inlier);
    benchmark::DoNotOptimize(problem.poses.data());
  }
  state.counters["edges"] = static_cast<double>(bundle.problem.edges.size());
  state.counters["iterations"] = summary.iterations;
  state.counters["final_cost"] = summary.final_cost;
}

void bm_adjust_bundle(benchmark::State& state) {
  run_bundle(state, [](BaProblem& p, std::vector<std::uint8_t>& inlier) { return adjust_bundle(p, {}, inlier); });
}
BENCHMARK(bm_adjust_bundle)->Args({24, 12, 1600})->Args({60, 20, 5000})->Unit(benchmark::kMillisecond);

void bm_adjust_bundle_ceres(benchmark::State& state) {
  run_bundle(state, [](BaProblem& p, std::vector<std::uint8_t>& inlier) { return adjust_bundle_ceres(p, {}, inlier); });
}
BENCHMARK(bm_adjust_bundle_ceres)->Args({24, 12, 1600})->Args({60, 20, 5000})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace semvslam
