#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "semvslam/base/random.h"
#include "semvslam/feature/lucas_kanade.h"

namespace semvslam {
namespace {

// Two images of 640x480 with smooth texture that moves by (6.4, -3.2) px, and 350 points.
struct Pair {
  cv::Mat first, second;
  std::vector<cv::Point2f> points;

  Pair() {
    Random random(3, "flow.bench");
    cv::Mat noise(120, 160, CV_8UC1), large;
    for (int y = 0; y < noise.rows; ++y)
      for (int x = 0; x < noise.cols; ++x) noise.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.index(256));
    cv::resize(noise, large, {960, 720}, 0, 0, cv::INTER_CUBIC);
    const auto view = [&](double x, double y, cv::Mat& out) {
      const cv::Mat matrix = (cv::Mat_<double>(2, 3) << 1, 0, x - 100, 0, 1, y - 100);
      cv::warpAffine(large, out, matrix, {640, 480}, cv::INTER_LINEAR);
    };
    view(0, 0, first);
    view(6.4, -3.2, second);
    for (int i = 0; i < 350; ++i)
      points.emplace_back(static_cast<float>(random.uniform(20, 620)), static_cast<float>(random.uniform(20, 460)));
  }
};

const Pair& pair() {
  static const Pair instance;
  return instance;
}

void flow_pyramid(benchmark::State& state) {
  FlowPyramid pyramid;
  for (auto _ : state) pyramid.build(pair().first, 3, 15);
}
BENCHMARK(flow_pyramid)->Unit(benchmark::kMicrosecond);

void flow_pyramid_opencv(benchmark::State& state) {
  cv::setNumThreads(1);
  std::vector<cv::Mat> pyramid;
  for (auto _ : state) cv::buildOpticalFlowPyramid(pair().first, pyramid, {15, 15}, 3);
}
BENCHMARK(flow_pyramid_opencv)->Unit(benchmark::kMicrosecond);

/// 350 points over `levels` levels above the image.
void follow_points(benchmark::State& state) {
  FlowPyramid from, to;
  from.build(pair().first, 3, 15);
  to.build(pair().second, 3, 15);
  LucasKanadeOptions options;
  options.levels = static_cast<int>(state.range(0));
  int found = 0;
  for (auto _ : state) {
    found = 0;
    for (const cv::Point2f& p : pair().points) {
      cv::Point2f q = p;
      found += follow_point(from, to, p, options, q);
    }
  }
  state.counters["found"] = found;
}
BENCHMARK(follow_points)->ArgName("levels")->Arg(3)->Arg(1)->Unit(benchmark::kMicrosecond);

void follow_points_opencv(benchmark::State& state) {
  cv::setNumThreads(1);
  const int levels = static_cast<int>(state.range(0));
  std::vector<cv::Mat> from, to;
  cv::buildOpticalFlowPyramid(pair().first, from, {15, 15}, levels);
  cv::buildOpticalFlowPyramid(pair().second, to, {15, 15}, levels);
  std::vector<cv::Point2f> found;
  std::vector<std::uint8_t> status;
  std::vector<float> error;
  for (auto _ : state)
    cv::calcOpticalFlowPyrLK(from, to, pair().points, found, status, error, {15, 15}, levels,
                             cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 12, 0.03));
}
BENCHMARK(follow_points_opencv)->ArgName("levels")->Arg(3)->Arg(1)->Unit(benchmark::kMicrosecond);

void track_checks(benchmark::State& state) {
  FlowPyramid from, to;
  from.build(pair().first, 3, 15);
  to.build(pair().second, 3, 15);
  for (auto _ : state)
    for (const cv::Point2f& p : pair().points) {
      benchmark::DoNotOptimize(patch_difference(from, p, to, p, 9, true));
      benchmark::DoNotOptimize(mean_texture(to, p, 5));
    }
}
BENCHMARK(track_checks)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace semvslam
