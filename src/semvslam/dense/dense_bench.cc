// What a dense map costs: adding a key frame, and taking the points and the octree out at the end.
#include <benchmark/benchmark.h>

#include <cmath>

#include "semvslam/dense/voxel_map.h"

using namespace semvslam;

namespace {

Camera camera() {
  Camera c;
  c.width_px = 640, c.height_px = 480;
  c.fx_px = c.fy_px = 525;
  c.cx_px = 319.5, c.cy_px = 239.5;
  return c;
}

/// A wavy wall about 2.5 m away.
RgbdFrame frame() {
  RgbdFrame f;
  f.depth = cv::Mat(480, 640, CV_16UC1);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x)
      f.depth.at<std::uint16_t>(y, x) =
          static_cast<std::uint16_t>(12500 + 1000 * std::sin(.01 * x) * std::cos(.02 * y));
  f.colour = cv::Mat(480, 640, CV_8UC3, cv::Scalar(50, 100, 150));
  return f;
}

SE3 pose(int k) { return {Eigen::Quaterniond::Identity(), {0.02 * k, 0.003 * k, 0}}; }

void integrate(benchmark::State& state) {
  const RgbdFrame f = frame();
  VoxelMap map(camera(), {});
  int k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(map.integrate(f, {}, pose(k++ % 100)));
}
BENCHMARK(integrate)->Unit(benchmark::kMillisecond);

VoxelMap map_of_100_key_frames() {
  const RgbdFrame f = frame();
  VoxelMap map(camera(), {});
  for (int k = 0; k < 100; ++k) (void)map.integrate(f, {}, pose(k));
  return map;
}

void points_of_100_key_frames(benchmark::State& state) {
  VoxelMap map = map_of_100_key_frames();
  std::size_t count = 0;
  for (auto _ : state) count = map.points().size();
  state.counters["points"] = static_cast<double>(count);
}
BENCHMARK(points_of_100_key_frames)->Unit(benchmark::kMillisecond);

void octree_of_100_key_frames(benchmark::State& state) {
  VoxelMap map = map_of_100_key_frames();
  const std::vector<CloudPoint> points = map.points();
  std::size_t cubes = 0, bytes = 0;
  for (auto _ : state) {
    const std::vector<OctreeLeaf> leaves = map.octree(points);
    cubes = leaves.size();
    bytes = format_bt(leaves, DenseOptions().octree_m).size();
  }
  state.counters["cubes"] = static_cast<double>(cubes);
  state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK(octree_of_100_key_frames)->Unit(benchmark::kMillisecond);

}  // namespace
