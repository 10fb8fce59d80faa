#include "semvslam/motion/motion_detector.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace semvslam {
namespace {

constexpr float kJudgeRadiusPx = 12;       // a feature takes the verdict of a track as near as that
constexpr float kAlikeDepthShare = 0.05f;  // and as deep as that, share of the depth

double ms_since(std::chrono::steady_clock::time_point& start) {
  const auto now = std::chrono::steady_clock::now();
  const double ms = std::chrono::duration<double, std::milli>(now - start).count();
  start = now;
  return ms;
}

}  // namespace

void MotionOptions::add_to(ConfigSchema& schema) {
  check.add_to(schema);
  flow.add_to(schema);
  fundamental.add_to(schema);
  camera.add_to(schema);
  regions.add_to(schema);
}

MotionDetector::MotionDetector(const Camera& camera, const MotionOptions& options)
    : camera_(camera),
      tracks_(camera, options.flow),
      check_(camera, options.check, options.camera, options.fundamental),
      regions_(camera, options.regions, options.check) {}

MotionResult MotionDetector::step(const MotionFrame& frame) {
  MotionResult result;
  result.frame = frame.id;
  auto clock = std::chrono::steady_clock::now();
  tracks_.step(frame);
  for (const LostTrack& lost : tracks_.lost()) ++result.lost[static_cast<std::size_t>(lost.reason)];
  result.flow_ms = ms_since(clock);
  result.check = check_.step(frame, tracks_.tracks(), regions_.mask());
  result.check_ms = ms_since(clock);
  regions_.step(frame, tracks_.tracks(), result.check);
  result.mask = regions_.mask();
  result.regions = regions_.regions();
  result.regions_ms = ms_since(clock);
  last_ = result;
  return result;
}

void MotionDetector::judge(std::span<const cv::Point2f> pixels, std::span<const float> depths_m,
                           std::vector<MotionVerdict>& verdicts) const {
  verdicts.assign(pixels.size(), MotionVerdict::kUnknown);
  if (last_.mask.empty()) return;
  const std::vector<FlowTrack>& tracks = tracks_.tracks();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const int x = std::clamp(static_cast<int>(std::lround(pixels[i].x)), 0, camera_.width_px - 1);
    const int y = std::clamp(static_cast<int>(std::lround(pixels[i].y)), 0, camera_.height_px - 1);
    if (last_.mask.at<std::uint8_t>(y, x)) {
      verdicts[i] = MotionVerdict::kMoving;
      continue;
    }
    float nearest = kJudgeRadiusPx;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      const TrackSample& sample = tracks[k].newest();
      if (last_.check.tracks[k].verdict == MotionVerdict::kUnknown) continue;
      const float distance = std::hypot(sample.pixel.x() - pixels[i].x, sample.pixel.y() - pixels[i].y);
      if (distance >= nearest) continue;
      if (depths_m[i] > 0 && sample.depth_m > 0 &&
          std::abs(depths_m[i] - sample.depth_m) > kAlikeDepthShare * sample.depth_m)
        continue;
      nearest = distance;
      verdicts[i] = last_.check.tracks[k].verdict;
    }
  }
}

}  // namespace semvslam
