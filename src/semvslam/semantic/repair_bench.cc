#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>

#include "semvslam/semantic/mask_carry.h"
#include "semvslam/semantic/segmentation_quality.h"

namespace semvslam {
namespace {

/// A textured ellipse over a textured wall, 640 x 480.
struct LargePerson {
  Camera camera;
  cv::Mat gray[2], depth[2], mask;
  cv::Rect window;

  /// @param share of the image that she covers
  explicit LargePerson(double share) {
    camera.width_px = 640;
    camera.height_px = 480;
    camera.fx_px = camera.fy_px = 520;
    camera.cx_px = 319.5;
    camera.cy_px = 239.5;
    cv::Mat wall(480, 700, CV_8UC1), cloth(480, 700, CV_8UC1);
    cv::RNG random(5);
    for (cv::Mat* m : {&wall, &cloth}) {
      random.fill(*m, cv::RNG::UNIFORM, 0, 256);
      cv::GaussianBlur(*m, *m, cv::Size(0, 0), 3);
      cv::normalize(*m, *m, 0, 255, cv::NORM_MINMAX);
    }
    const double half_height = 225, half_width = share * 640 * 480 / (CV_PI * half_height);
    for (int i : {0, 1}) {
      cv::Mat person = cv::Mat::zeros(480, 640, CV_8UC1);
      cv::ellipse(person, {300 + 12 * i, 240}, {static_cast<int>(half_width), static_cast<int>(half_height)}, 0, 0, 360,
                  255, cv::FILLED);
      gray[i] = wall(cv::Rect(30, 0, 640, 480)).clone();
      cloth(cv::Rect(30 - 12 * i, 0, 640, 480)).copyTo(gray[i], person);
      depth[i] = cv::Mat(480, 640, CV_16UC1, cv::Scalar(15000));
      depth[i].setTo(9000, person);
      if (i == 0) {
        window = cv::boundingRect(person);
        mask = person(window).clone();
      }
    }
  }
};

/// All that one frame costs: half-size images and pyramid of the present one, and the carrying. The earlier frame's are
/// there already.
void carry(benchmark::State& state) {
  const LargePerson scene(static_cast<double>(state.range(0)) / 100);
  const MaskCarry carrier(scene.camera, {});
  const CarryFrame from(scene.camera, scene.gray[0], scene.depth[0]);
  from.pyramid();
  from.half_depth_m();
  for (auto _ : state) {
    const CarryFrame to(scene.camera, scene.gray[1], scene.depth[1]);
    benchmark::DoNotOptimize(carrier.carry(from, to, scene.window, scene.mask, std::nullopt));
  }
}
BENCHMARK(carry)->Name("carry/percent_of_image")->Arg(10)->Arg(40)->Unit(benchmark::kMillisecond);

void detect(benchmark::State& state) {
  MissingSegmentationDetector detector;
  std::uint32_t frame = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(detector.step(FrameId(frame), static_cast<int>(frame % 977)));
    ++frame;
  }
}
BENCHMARK(detect);

}  // namespace
}  // namespace semvslam
