#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>

#include "semvslam/motion/motion_detector.h"
#include "semvslam/motion/motion_test_support.h"

namespace semvslam {
namespace {

// A textured wall at 3 m with a textured box before it that moves, seen by a camera that goes sideways.
class Film {
 public:
  static constexpr int kFrames = 24;

  Film() {
    Random random(3, "bench");
    cv::Mat noise(200, 260, CV_8UC1), wall;
    for (int y = 0; y < noise.rows; ++y)
      for (int x = 0; x < noise.cols; ++x) noise.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.index(256));
    cv::resize(noise, wall, {1040, 800}, 0, 0, cv::INTER_CUBIC);
    for (int k = 0; k < kFrames; ++k) {
      // There and back, so that the film can be repeated without a jump.
      const int step = k < kFrames / 2 ? k : kFrames - k;
      cv::Mat gray = wall(cv::Rect(100 + 3 * step, 100, 640, 480)).clone();
      cv::Mat depth(480, 640, CV_16UC1, cv::Scalar(15000));
      const cv::Rect box(200 + 5 * step, 120, 160, 220);
      wall(cv::Rect(700, 400, 160, 220)).copyTo(gray(box));
      depth(box).setTo(7500);
      MotionFrame frame;
      frame.gray = gray;
      frame.depth = depth;
      frames.push_back(frame);
    }
    for (int y = 12; y < 470; y += 12)
      for (int x = 12; x < 630; x += 12) corners.emplace_back(static_cast<float>(x), static_cast<float>(y));
  }
  std::vector<MotionFrame> frames;
  std::vector<cv::Point2f> corners;
};

const Film& film() {
  static const Film instance;
  return instance;
}

MotionFrame frame_at(std::uint32_t index, bool corners) {
  MotionFrame frame = film().frames[index % Film::kFrames];
  frame.id = FrameId(index);
  frame.time_s = index / 30.0;
  if (corners) frame.corners = film().corners;
  return frame;
}

void whole_frame(benchmark::State& state) {
  cv::setNumThreads(1);
  MotionDetector detector(motion_testing::test_camera(), {});
  std::uint32_t index = 0;
  double flow_ms = 0, check_ms = 0, regions_ms = 0;
  for (int k = 0; k < 12; ++k) detector.step(frame_at(index++, state.range(0) != 0));
  for (auto _ : state) {
    const MotionResult result = detector.step(frame_at(index++, state.range(0) != 0));
    flow_ms += result.flow_ms;
    check_ms += result.check_ms;
    regions_ms += result.regions_ms;
  }
  const auto mean = [&](double sum) { return benchmark::Counter(sum, benchmark::Counter::kAvgIterations); };
  state.counters["flow_ms"] = mean(flow_ms);
  state.counters["check_ms"] = mean(check_ms);
  state.counters["regions_ms"] = mean(regions_ms);
}
BENCHMARK(whole_frame)->ArgName("given_corners")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void flow_tracks_step(benchmark::State& state) {
  cv::setNumThreads(1);
  FlowTracks flow(motion_testing::test_camera(), {});
  std::uint32_t index = 0;
  for (auto _ : state) flow.step(frame_at(index++, true));
  state.counters["tracks"] = static_cast<double>(flow.tracks().size());
}
BENCHMARK(flow_tracks_step)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace semvslam
