#include <benchmark/benchmark.h>

#include <vector>

#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/triangulation.h"

namespace semvslam {
namespace {

Camera freiburg1() {
  Camera c;
  c.width_px = 640;
  c.height_px = 480;
  c.fx_px = 517.3;
  c.fy_px = 516.5;
  c.cx_px = 318.6;
  c.cy_px = 255.3;
  c.distortion = {0.2624, -0.9531, -0.0054, 0.0026, 1.1633};
  return c;
}

void bm_undistort_1000_pixels(benchmark::State& state) {
  const Camera camera = freiburg1();
  Eigen::Vector2d sum(0, 0);
  for (auto _ : state) {
    for (int i = 0; i < 1000; ++i) sum += camera.undistort({(i * 37) % 640, (i * 53) % 480});
    benchmark::DoNotOptimize(sum);
  }
}
BENCHMARK(bm_undistort_1000_pixels)->Unit(benchmark::kMicrosecond);

void bm_triangulate(benchmark::State& state) {
  const Camera camera = freiburg1();
  const SE3 a, b(Eigen::Quaterniond(0.99, 0, 0.05, 0), Eigen::Vector3d(-0.2, 0, 0));
  const Eigen::Vector3d p(0.3, 0.2, 3);
  const Eigen::Vector2d pixel_a = camera.project(a * p), pixel_b = camera.project(b * p) + Eigen::Vector2d(0.5, 0.5);
  for (auto _ : state) benchmark::DoNotOptimize(triangulate(camera, a, pixel_a, camera, b, pixel_b));
}
BENCHMARK(bm_triangulate);

}  // namespace
}  // namespace semvslam
