#include "semvslam/motion/flow_tracks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <stdexcept>

namespace semvslam {
namespace {

constexpr int kPatchRadiusPx = 4;      // of the appearance check
constexpr int kFastThreshold = 12;     // grey levels, where corners are searched for here
constexpr int kFarthestStartPx = 120;  // a predicted position farther from the last one is not believed

// Grid of bins as large as the least distance between two points: at most a few points per bin, neighbours suffice.
class Occupancy {
 public:
  Occupancy(int width, int height, int distance)
      : distance_(std::max(1, distance)),
        columns_(width / distance_ + 3),
        bins_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(height / distance_ + 3)) {}

  /// Takes the place unless another point is too near.
  bool take(float x, float y) {
    const int bx = static_cast<int>(x) / distance_ + 1, by = static_cast<int>(y) / distance_ + 1;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        for (const auto& p : bins_[index(bx + dx, by + dy)])
          if (std::hypot(p.x - x, p.y - y) < static_cast<float>(distance_)) return false;
    bins_[index(bx, by)].push_back({x, y});
    return true;
  }

 private:
  std::size_t index(int bx, int by) const {
    return static_cast<std::size_t>(by) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(bx);
  }
  int distance_, columns_;
  std::vector<std::vector<cv::Point2f>> bins_;
};

float grey_at(const cv::Mat& image, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float ax = x - static_cast<float>(ix), ay = y - static_cast<float>(iy);
  const std::uint8_t* top = image.ptr<std::uint8_t>(iy) + ix;
  const std::uint8_t* bottom = image.ptr<std::uint8_t>(iy + 1) + ix;
  return (top[0] * (1 - ax) + top[1] * ax) * (1 - ay) + (bottom[0] * (1 - ax) + bottom[1] * ax) * ay;
}

// Mean absolute difference of two patches without the difference of their means. Both lie inside with their margin.
double patch_difference(const cv::Mat& a, const cv::Point2f& at_a, const cv::Mat& b, const cv::Point2f& at_b) {
  constexpr int kSide = 2 * kPatchRadiusPx + 1, kCount = kSide * kSide;
  std::array<float, kCount> difference;
  float mean = 0;
  int k = 0;
  for (int dy = -kPatchRadiusPx; dy <= kPatchRadiusPx; ++dy)
    for (int dx = -kPatchRadiusPx; dx <= kPatchRadiusPx; ++dx, ++k) {
      const float fx = static_cast<float>(dx), fy = static_cast<float>(dy);
      difference[static_cast<std::size_t>(k)] =
          grey_at(a, at_a.x + fx, at_a.y + fy) - grey_at(b, at_b.x + fx, at_b.y + fy);
      mean += difference[static_cast<std::size_t>(k)];
    }
  mean /= kCount;
  float sum = 0;
  for (const float d : difference) sum += std::abs(d - mean);
  return sum / kCount;
}

// How far the depths around a place lie off a straight surface, the largest of four directions.
float depth_bend_m(const cv::Mat& depth, float metres_per_unit, int x, int y, int reach_px, float centre_m) {
  if (x < reach_px || y < reach_px || x >= depth.cols - reach_px || y >= depth.rows - reach_px) return 0;
  float bend = 0;
  for (const auto& [dx, dy] : {std::pair{reach_px, 0}, {0, reach_px}, {reach_px, reach_px}, {reach_px, -reach_px}}) {
    const float a = depth_at_m(depth, metres_per_unit, x + dx, y + dy);
    const float b = depth_at_m(depth, metres_per_unit, x - dx, y - dy);
    if (a > 0 && b > 0)
      bend = std::max(bend, std::abs(a + b - 2 * centre_m));
    else if (a > 0 || b > 0)
      bend = std::max(bend, std::abs(std::max(a, b) - centre_m));
  }
  return bend;
}

// Mean products of the grey value's derivatives over the patch: (xx, xy, yy).
Eigen::Vector3f texture_of(const cv::Mat& derivatives, const Eigen::Vector2f& pixel) {
  constexpr int kRadiusPx = 5;
  constexpr float kScharr = 1.f / 32;  // sum of the filter's weights on one side
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  int xx = 0, xy = 0, yy = 0;  // Scharr of 8 bits stays below 2^13: the sums of 121 squares need some of its bits shed
  for (int v = y - kRadiusPx; v <= y + kRadiusPx; ++v) {
    const short* row = derivatives.ptr<short>(v) + 2 * (x - kRadiusPx);
    for (int k = 0; k <= 2 * kRadiusPx; ++k) {
      const int gx = row[2 * k] >> 2, gy = row[2 * k + 1] >> 2;
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  constexpr int kCount = (2 * kRadiusPx + 1) * (2 * kRadiusPx + 1);
  const float scale = 16 * kScharr * kScharr / kCount;
  return {static_cast<float>(xx) * scale, static_cast<float>(xy) * scale, static_cast<float>(yy) * scale};
}

float median_depth_m(const cv::Mat& depth, float metres_per_unit, int x, int y) {
  std::array<float, 9> values;
  std::size_t count = 0;
  for (int v = std::max(0, y - 1); v <= std::min(depth.rows - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(depth.cols - 1, x + 1); ++u)
      if (const float d = depth_at_m(depth, metres_per_unit, u, v); d > 0) values[count++] = d;
  if (count < 3) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count / 2),
                   values.begin() + static_cast<std::ptrdiff_t>(count));
  return values[count / 2];
}

bool inside_mask(const cv::Mat& mask, const Eigen::Vector2f& pixel) {
  if (mask.empty()) return false;
  const int x = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, mask.cols - 1);
  const int y = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, mask.rows - 1);
  return mask.at<std::uint8_t>(y, x) != 0;
}

void require(bool holds, const char* what) {
  if (!holds) throw std::invalid_argument(fmt::format("motion frame: {}", what));
}

void check_frame(const MotionFrame& frame, const Camera& camera) {
  const cv::Size size(camera.width_px, camera.height_px);
  require(frame.gray.type() == CV_8UC1 && frame.gray.size() == size, "gray must be CV_8UC1 of the camera's size");
  require(frame.depth.empty() ||
              (frame.depth.size() == size && (frame.depth.type() == CV_16UC1 || frame.depth.type() == CV_32FC1)),
          "depth must be CV_16UC1 or CV_32FC1 of the camera's size");
  require(frame.excluded.empty() || (frame.excluded.size() == size && frame.excluded.type() == CV_8UC1),
          "excluded must be CV_8UC1 of the camera's size");
  require(frame.instances.empty() || (frame.instances.size() == size && frame.instances.type() == CV_16UC1),
          "instances must be CV_16UC1 of the camera's size");
}

}  // namespace

std::string_view to_string(TrackLoss loss) {
  switch (loss) {
    case TrackLoss::kNotFound:
      return "not_found";
    case TrackLoss::kBorder:
      return "border";
    case TrackLoss::kBackward:
      return "backward";
    case TrackLoss::kAppearance:
      return "appearance";
    case TrackLoss::kCrowded:
      return "crowded";
  }
  return "";
}

void FlowTrackOptions::add_to(ConfigSchema& schema) {
  schema.add("motion.flow.tracks", &tracks, {20, 5000}, "points followed from frame to frame");
  schema.add("motion.flow.cell_px", &cell_px, {8, 640}, "side of the cells over which they are spread, px");
  schema.add("motion.flow.min_distance_px", &min_distance_px, {2, 100}, "least distance between two of them, px");
  schema.add("motion.flow.window_px", &window_px, {5, 41}, "side of the patch that is followed, px");
  schema.add("motion.flow.levels", &levels, {0, 6}, "levels of the image pyramid above the image");
  schema.add("motion.flow.max_backward_px", &max_backward_px, {0.05, 20.0},
             "following a point back may miss where it came from by so much, px");
  schema.add("motion.flow.max_patch_difference", &max_patch_difference, {1.0, 255.0},
             "its surroundings may differ by so much between frames, mean grey levels");
  schema.add("motion.flow.border_px", &border_px, {6, 100}, "no points nearer to the image's border, px");
}

void FlowTrack::push(const TrackSample& sample) {
  head_ = (head_ + 1) % kCapacity;
  samples_[static_cast<std::size_t>(head_)] = sample;
  size_ = std::min(size_ + 1, kCapacity);
  ++length_;
}

FlowTracks::FlowTracks(const Camera& camera, const FlowTrackOptions& options) : camera_(camera), options_(options) {
  options_.window_px |= 1;  // odd: a patch has a middle
  options_.border_px = std::max(options_.border_px, kPatchRadiusPx + 2);
}

void FlowTracks::reset() {
  tracks_.clear();
  lost_.clear();
  pyramid_.clear();
  previous_pyramid_.clear();
}

void FlowTracks::step(const MotionFrame& frame) {
  check_frame(frame, camera_);
  lost_.clear();
  std::swap(pyramid_, previous_pyramid_);
  cv::buildOpticalFlowPyramid(frame.gray, pyramid_, cv::Size(options_.window_px, options_.window_px), options_.levels,
                              true, cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
  if (!tracks_.empty() && !previous_pyramid_.empty()) {
    predict(frame);
    follow(frame);
  }
  refill(frame);
}

void FlowTracks::predict(const MotionFrame& frame) {
  from_.clear();
  to_.clear();
  for (const FlowTrack& track : tracks_) {
    const TrackSample& last = track.newest();
    from_.emplace_back(last.pixel.x(), last.pixel.y());
    cv::Point2f start = from_.back();
    // A point without depth is taken as far away: then rotation alone moves it.
    if (frame.cur_from_prev) {
      constexpr double kFarM = 4;
      const double depth_m = last.depth_m > 0 ? last.depth_m : kFarM;
      const Eigen::Vector3d point = *frame.cur_from_prev * camera_.back_project(last.ideal.cast<double>(), depth_m);
      if (point.z() > 0.05) {
        const Eigen::Vector2d pixel = camera_.distort(camera_.project(point));
        const cv::Point2f predicted(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
        if (cv::norm(predicted - start) < kFarthestStartPx) start = predicted;
      }
    }
    to_.push_back(start);
  }
}

void FlowTracks::follow(const MotionFrame& frame) {
  const cv::Size window(options_.window_px, options_.window_px);
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 12, 0.03);
  const std::vector<cv::Point2f> start = to_;
  cv::calcOpticalFlowPyrLK(previous_pyramid_, pyramid_, from_, to_, found_, error_, window, options_.levels, until,
                           cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  // Back from where it was found, starting off the known answer by the correction that the way here made: a check that
  // starts at the answer could not fail.
  back_.resize(to_.size());
  for (std::size_t i = 0; i < to_.size(); ++i) back_[i] = from_[i] + (to_[i] - start[i]);
  cv::calcOpticalFlowPyrLK(pyramid_, previous_pyramid_, to_, back_, found_back_, error_, window,
                           std::min(1, options_.levels), until, cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);

  Occupancy occupied(camera_.width_px, camera_.height_px, std::max(2, options_.min_distance_px / 2));
  const float border = static_cast<float>(options_.border_px);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const cv::Point2f to = to_[i];
    std::optional<TrackLoss> loss;
    if (!(to.x >= border && to.y >= border && to.x < static_cast<float>(camera_.width_px) - border &&
          to.y < static_cast<float>(camera_.height_px) - border))
      loss = TrackLoss::kBorder;
    else if (!found_[i])
      loss = TrackLoss::kNotFound;
    else if (!found_back_[i] || cv::norm(back_[i] - from_[i]) > options_.max_backward_px)
      loss = TrackLoss::kBackward;
    else if (patch_difference(previous_pyramid_[0], from_[i], pyramid_[0], to) > options_.max_patch_difference)
      loss = TrackLoss::kAppearance;
    else if (!occupied.take(to.x, to.y))
      loss = TrackLoss::kCrowded;
    if (loss) {
      lost_.push_back({tracks_[i].id(), *loss});
      continue;
    }
    tracks_[i].push(make_sample(frame, {to.x, to.y}));
    if (kept != i) tracks_[kept] = tracks_[i];
    ++kept;
  }
  tracks_.erase(tracks_.begin() + static_cast<std::ptrdiff_t>(kept), tracks_.end());
}

TrackSample FlowTracks::make_sample(const MotionFrame& frame, const Eigen::Vector2f& pixel) const {
  TrackSample sample;
  sample.frame = frame.id;
  sample.time_s = frame.time_s;
  sample.pixel = pixel;
  sample.ideal = camera_.undistort(pixel.cast<double>()).cast<float>();
  sample.excluded = inside_mask(frame.excluded, pixel);
  sample.texture = texture_of(pyramid_[1], pixel);
  if (!frame.depth.empty()) {
    const float unit = static_cast<float>(1 / camera_.depth_units_per_m);
    const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
    sample.depth_m = median_depth_m(frame.depth, unit, x, y);
    if (sample.depth_m > 0)
      sample.depth_spread_m =
          std::max(depth_bend_m(frame.depth, unit, x, y, 2, sample.depth_m),
                   depth_bend_m(frame.depth, unit, x, y, options_.window_px / 2 - 1, sample.depth_m));
  }
  return sample;
}

void FlowTracks::refill(const MotionFrame& frame) {
  const int missing = options_.tracks - static_cast<int>(tracks_.size());
  if (missing <= 0) return;
  const int cell = options_.cell_px;
  const int columns = (camera_.width_px + cell - 1) / cell, rows = (camera_.height_px + cell - 1) / cell;
  const int per_cell = std::max(1, (options_.tracks + columns * rows - 1) / (columns * rows));
  std::vector<int> count(static_cast<std::size_t>(columns * rows), 0);
  const auto cell_of = [&](const cv::Point2f& p) {
    return static_cast<std::size_t>(static_cast<int>(p.y) / cell * columns + static_cast<int>(p.x) / cell);
  };
  Occupancy occupied(camera_.width_px, camera_.height_px, options_.min_distance_px);
  for (const FlowTrack& track : tracks_) {
    const cv::Point2f p(track.newest().pixel.x(), track.newest().pixel.y());
    occupied.take(p.x, p.y);
    ++count[cell_of(p)];
  }
  const float border = static_cast<float>(options_.border_px);
  const auto offer = [&](const cv::Point2f& p) {
    if (static_cast<int>(tracks_.size()) >= options_.tracks) return;
    if (!(p.x >= border && p.y >= border && p.x < static_cast<float>(camera_.width_px) - border &&
          p.y < static_cast<float>(camera_.height_px) - border))
      return;
    if (count[cell_of(p)] >= per_cell || inside_mask(frame.excluded, {p.x, p.y}) || !occupied.take(p.x, p.y)) return;
    ++count[cell_of(p)];
    tracks_.emplace_back(PointTrackId(next_id_++));
    tracks_.back().push(make_sample(frame, {p.x, p.y}));
  };
  if (!frame.corners.empty()) {
    for (const cv::Point2f& p : frame.corners) offer(p);
    return;
  }
  std::vector<cv::KeyPoint> corners;
  cv::Mat strength;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      if (count[static_cast<std::size_t>(row * columns + column)] >= per_cell) continue;
      // FAST looks three pixels around a corner.
      const cv::Rect window =
          cv::Rect(column * cell - 3, row * cell - 3, cell + 6, cell + 6) & cv::Rect({0, 0}, frame.gray.size());
      cv::FAST(frame.gray(window), corners, kFastThreshold, true);
      if (corners.empty()) continue;
      // FAST answers to edges too; the smaller eigenvalue of the gradient's second moments tells corners (Shi, Tomasi).
      cv::cornerMinEigenVal(frame.gray(window), strength, 5, 3);
      for (cv::KeyPoint& corner : corners) corner.response = strength.at<float>(cv::Point(corner.pt));
      std::sort(corners.begin(), corners.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
        return a.response != b.response ? a.response > b.response
                                        : std::pair(a.pt.y, a.pt.x) < std::pair(b.pt.y, b.pt.x);
      });
      for (const cv::KeyPoint& corner : corners)
        if (corner.response > 0.1f * corners.front().response) offer(corner.pt + cv::Point2f(window.tl()));
    }
}

}  // namespace semvslam
