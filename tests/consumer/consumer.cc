// Uses an installed semvslam the way a foreign program would: frames in, poses out, the evaluation library,
// the segmentation network that comes along.
#include <cstdio>
#include <opencv2/core.hpp>

#include "semvslam/eval/statistics.h"
#include "semvslam/pipeline/slam.h"
#include "semvslam/semantic/segmenter.h"

int main() {
  semvslam::Camera camera;
  camera.width_px = 320, camera.height_px = 240;
  camera.fx_px = camera.fy_px = 260, camera.cx_px = 160, camera.cy_px = 120;
  semvslam::Config config;
  config.deterministic = true;
  auto slam = semvslam::Slam::create(config, camera);
  if (!slam) return std::fprintf(stderr, "%s\n", slam.error().message.c_str()), 1;

  semvslam::RgbdFrame frame;
  frame.gray = cv::Mat(camera.height_px, camera.width_px, CV_8UC1);
  frame.depth = cv::Mat(camera.height_px, camera.width_px, CV_16UC1, cv::Scalar(10000));  // a wall 2 m away
  cv::RNG random(1);
  random.fill(frame.gray, cv::RNG::UNIFORM, 0, 255);
  for (int i = 0; i < 3; ++i) {
    frame.stamp = semvslam::TimeStamp::from_seconds(i / 30.0);
    const auto result = (*slam)->process(frame);
    if (!result) return std::fprintf(stderr, "%s\n", result.error().message.c_str()), 1;
  }
  auto segmenter = semvslam::make_segmenter({}, semvslam::RoleTable());
  if (!segmenter) return std::fprintf(stderr, "%s\n", segmenter.error().message.c_str()), 1;
  const cv::Mat picture(480, 640, CV_8UC3, cv::Scalar::all(90));
  if (!(*segmenter)->segment({semvslam::FrameId(0), {}, picture, ""})) return 1;
  const double errors[] = {3, 4};
  return (*slam)->finish().ok() && semvslam::error_statistics(errors).max == 4 ? 0 : 1;
}
