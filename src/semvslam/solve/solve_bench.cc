#include <benchmark/benchmark.h>

#include "semvslam/solve/bundle_adjustment.h"
#include "semvslam/solve/bundle_adjustment_ceres.h"
#include "semvslam/solve/pnp.h"
#include "semvslam/solve/pose_graph.h"
#include "semvslam/solve/pose_optimizer.h"
#include "semvslam/solve/synthetic_test_scenes.h"

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

// A whole map: 400 key frames in a chain, each point seen by neighbours only.
void bm_adjust_whole_map(benchmark::State& state) {
  synthetic::BundleOptions o;
  o.poses = 400;
  o.fixed = 1;
  o.points = 20000;
  o.neighbours = 8;
  const synthetic::Bundle bundle = synthetic::make_bundle(o);
  std::vector<std::uint8_t> inlier;
  BaSummary summary;
  for (auto _ : state) {
    BaProblem problem = bundle.problem;
    summary = adjust_bundle(problem, {}, inlier);
  }
  state.counters["edges"] = static_cast<double>(bundle.problem.edges.size());
  state.counters["iterations"] = summary.iterations;
}
BENCHMARK(bm_adjust_whole_map)->Unit(benchmark::kMillisecond);

void bm_pose_from_matches(benchmark::State& state) {
  synthetic::BundleOptions o;
  o.points = 150;
  o.outlier_share = 0.01 * static_cast<double>(state.range(0));
  const synthetic::View view = synthetic::make_view(o);
  int iterations = 0;
  for (auto _ : state) {
    const auto r = estimate_pose(Intrinsics::of(synthetic::vga_camera()), view.points, view.observations);
    iterations = r.ok() ? r->iterations : -1;
  }
  state.counters["iterations"] = iterations;
}
BENCHMARK(bm_pose_from_matches)->Arg(20)->Arg(60)->Unit(benchmark::kMicrosecond);

// A ring of key frames with drift, closed by one loop edge.
void bm_pose_graph(benchmark::State& state) {
  PoseGraphProblem start;
  const auto n = static_cast<std::uint32_t>(state.range(0));
  const SE3 step(Eigen::Quaterniond(Eigen::AngleAxisd(6.2831853 / n, Eigen::Vector3d::UnitY())),
                 Eigen::Vector3d(0.1, 0, 0));
  SE3::Tangent drift;
  drift << 1e-3, 1e-3, -1e-3, 5e-4, 5e-4, -5e-4;
  for (std::uint32_t i = 0; i < n; ++i) {
    start.world_from_pose.push_back(i == 0 ? SE3() : start.world_from_pose.back() * step * SE3::exp(drift));
    start.fixed.push_back(i == 0);
    PoseGraphProblem::Edge e;
    e.a = i;
    e.b = (i + 1) % n;
    e.a_from_b = step;
    start.edges.push_back(e);
  }
  PoseGraphSummary summary;
  for (auto _ : state) {
    PoseGraphProblem problem = start;
    summary = optimize_pose_graph(problem);
  }
  state.counters["iterations"] = summary.iterations;
}
BENCHMARK(bm_pose_graph)->Arg(200)->Arg(2000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace semvslam
