#include "semvslam/motion/motion_detector.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace semvslam {
namespace {

constexpr float kJudgeRadiusPx = 12;       // a feature takes the verdict of a track as near as that
constexpr float kSureRadiusPx = 4;         // well within the patch that is tracked
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

void MotionDetector::follow(const MotionFrame& frame) {
  auto clock = std::chrono::steady_clock::now();
  tracks_.follow(frame);
  followed_ms_ = ms_since(clock);
}

MotionResult MotionDetector::step(const MotionFrame& frame) {
  MotionResult result;
  result.frame = frame.id;
  auto clock = std::chrono::steady_clock::now();
  tracks_.step(frame);
  for (const LostTrack& lost : tracks_.lost()) ++result.lost[static_cast<std::size_t>(lost.reason)];
  result.flow_ms = ms_since(clock) + std::exchange(followed_ms_, 0);
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
                           std::vector<PointVerdict>& verdicts) const {
  verdicts.assign(pixels.size(), {});
  // Tracks with a verdict by square of the image as wide as the radius: those around are in the nine next to it.
  struct Judged {
    float x, y, depth_m;
    MotionVerdict verdict;
    int next;  // in the same square; -1 = none
  };
  constexpr int kSide = static_cast<int>(kJudgeRadiusPx);
  const int columns = camera_.width_px / kSide + 3, rows = camera_.height_px / kSide + 3;
  const auto square_of = [&](float x, float y) {
    return (static_cast<int>(y) / kSide + 1) * columns + static_cast<int>(x) / kSide + 1;
  };
  std::vector<int> first(static_cast<std::size_t>(columns * rows), -1);
  std::vector<Judged> judged;
  const std::vector<FlowTrack>& tracks = tracks_.tracks();
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (last_.check.tracks[k].verdict == MotionVerdict::kUnknown) continue;
    const TrackSample& sample = tracks[k].newest();
    int& square = first[static_cast<std::size_t>(square_of(sample.pixel.x(), sample.pixel.y()))];
    judged.push_back({sample.pixel.x(), sample.pixel.y(), sample.depth_m, last_.check.tracks[k].verdict, square});
    square = static_cast<int>(judged.size()) - 1;
  }
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    float nearest = kJudgeRadiusPx * kJudgeRadiusPx;  // squared
    const int middle = square_of(std::clamp(pixels[i].x, 0.f, static_cast<float>(camera_.width_px - 1)),
                                 std::clamp(pixels[i].y, 0.f, static_cast<float>(camera_.height_px - 1)));
    for (const int offset : {-columns - 1, -columns, -columns + 1, -1, 0, 1, columns - 1, columns, columns + 1})
      for (int k = first[static_cast<std::size_t>(middle + offset)]; k >= 0;) {
        const Judged& track = judged[static_cast<std::size_t>(k)];
        k = track.next;
        const float dx = track.x - pixels[i].x, dy = track.y - pixels[i].y, squared = dx * dx + dy * dy;
        if (squared >= nearest) continue;
        const bool measured = depths_m[i] > 0 && track.depth_m > 0;
        if (measured && std::abs(depths_m[i] - track.depth_m) > kAlikeDepthShare * track.depth_m) continue;
        nearest = squared;
        verdicts[i] = {track.verdict, measured && squared < kSureRadiusPx * kSureRadiusPx};
      }
  }
}

}  // namespace semvslam
