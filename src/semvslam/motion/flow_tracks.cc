#include "semvslam/motion/flow_tracks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "semvslam/base/ranked.h"
#include "semvslam/geometry/mask_lookup.h"

namespace semvslam {
namespace {

constexpr int kPatchRadiusPx = 4;        // of the appearance check
constexpr int kTextureRadiusPx = 5;      // of TrackSample::texture
constexpr int kFastThreshold = 12;       // grey levels, where corners are searched for here
constexpr float kFarthestStartPx = 120;  // a predicted position farther from the last one is not believed

// Grid of bins as large as the least distance between two points: at most a few points per bin, neighbours suffice.
class Occupancy {
 public:
  Occupancy(int width, int height, int distance)
      : distance_(std::max(1, distance)),
        columns_(width / distance_ + 3),
        first_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(height / distance_ + 3), kNone) {}

  /// Takes the place unless another point is too near.
  bool take(float x, float y) {
    const int bx = static_cast<int>(x) / distance_ + 1, by = static_cast<int>(y) / distance_ + 1;
    const float squared_limit = static_cast<float>(distance_) * static_cast<float>(distance_);
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        for (int i = first_[index(bx + dx, by + dy)]; i != kNone;) {
          const Point& p = points_[static_cast<std::size_t>(i)];
          if ((p.x - x) * (p.x - x) + (p.y - y) * (p.y - y) < squared_limit) return false;
          i = p.next;
        }
    int& first = first_[index(bx, by)];
    points_.push_back({x, y, first});
    first = static_cast<int>(points_.size()) - 1;
    return true;
  }

 private:
  static constexpr int kNone = -1;
  struct Point {
    float x, y;
    int next;  // in the same bin
  };
  std::size_t index(int bx, int by) const {
    return static_cast<std::size_t>(by) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(bx);
  }
  int distance_, columns_;
  std::vector<int> first_;  // per bin
  std::vector<Point> points_;
};

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

float median_depth_m(const cv::Mat& depth, float metres_per_unit, int x, int y) {
  std::array<float, 9> values;
  std::size_t count = 0;
  for (int v = std::max(0, y - 1); v <= std::min(depth.rows - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(depth.cols - 1, x + 1); ++u)
      if (const float d = depth_at_m(depth, metres_per_unit, u, v); d > 0) values[count++] = d;
  if (count < 3) return 0;
  return median(std::span(values).first(count));
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
  require(frame.watched.empty() || (frame.watched.size() == size && frame.watched.type() == CV_8UC1),
          "watched must be CV_8UC1 of the camera's size");
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
  forward_.window_px = backward_.window_px = options_.window_px;
  forward_.levels = options_.levels;
  backward_.levels = std::min(1, options_.levels);
}

void FlowTracks::reset() {
  tracks_.clear();
  lost_.clear();
  pyramid_ = previous_pyramid_ = {};
  followed_ = false;
}

void FlowTracks::follow(const MotionFrame& frame) {
  check_frame(frame, camera_);
  lost_.clear();
  std::swap(pyramid_, previous_pyramid_);
  pyramid_.build(frame.gray, options_.levels, options_.window_px);
  if (!tracks_.empty() && !previous_pyramid_.empty()) follow_all(frame);
  followed_ = true;
}

void FlowTracks::step(const MotionFrame& frame) {
  check_frame(frame, camera_);
  if (!followed_) follow(frame);
  followed_ = false;
  refill(frame);
  for (FlowTrack& track : tracks_) {
    const Eigen::Vector2f& pixel = track.newest().pixel;
    track.set_newest_excluded(is_masked(frame.excluded, {pixel.x(), pixel.y()}));
  }
}

bool FlowTracks::is_inside(cv::Point2f p) const {
  const auto border = static_cast<float>(options_.border_px);
  return p.x >= border && p.y >= border && p.x < static_cast<float>(camera_.width_px) - border &&
         p.y < static_cast<float>(camera_.height_px) - border;
}

cv::Point2f FlowTracks::predict(const MotionFrame& frame, const TrackSample& last) const {
  const cv::Point2f same(last.pixel.x(), last.pixel.y());
  if (!frame.cur_from_prev) return same;
  // A point without depth is taken as far away: then rotation alone moves it.
  constexpr double kFarM = 4;
  const double depth_m = last.depth_m > 0 ? last.depth_m : kFarM;
  const Eigen::Vector3d point = *frame.cur_from_prev * camera_.back_project(last.ideal.cast<double>(), depth_m);
  if (point.z() <= 0.05) return same;
  const Eigen::Vector2d pixel = camera_.distort(camera_.project(point));
  const cv::Point2f predicted(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  return cv::norm(predicted - same) < kFarthestStartPx ? predicted : same;
}

std::variant<cv::Point2f, TrackLoss> FlowTracks::find(cv::Point2f from, cv::Point2f start) const {
  cv::Point2f to = start;
  const bool found = follow_point(previous_pyramid_, pyramid_, from, forward_, to);
  if (!is_inside(to)) return TrackLoss::kBorder;
  if (!found) return TrackLoss::kNotFound;
  // Back from where it was found, starting off the known answer by the correction that the way here made: a check that
  // starts at the answer could not fail.
  cv::Point2f back = from + (to - start);
  if (!follow_point(pyramid_, previous_pyramid_, to, backward_, back) ||
      cv::norm(back - from) > options_.max_backward_px)
    return TrackLoss::kBackward;
  if (patch_difference(previous_pyramid_, from, pyramid_, to, 2 * kPatchRadiusPx + 1, true) >
      options_.max_patch_difference)
    return TrackLoss::kAppearance;
  return to;
}

void FlowTracks::follow_all(const MotionFrame& frame) {
  Occupancy occupied(camera_.width_px, camera_.height_px, std::max(2, options_.min_distance_px / 2));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const TrackSample& last = tracks_[i].newest();
    std::variant<cv::Point2f, TrackLoss> went = find({last.pixel.x(), last.pixel.y()}, predict(frame, last));
    if (const auto* to = std::get_if<cv::Point2f>(&went); to && !occupied.take(to->x, to->y))
      went = TrackLoss::kCrowded;
    if (const auto* loss = std::get_if<TrackLoss>(&went)) {
      lost_.push_back({tracks_[i].id(), *loss});
      continue;
    }
    const auto to = std::get<cv::Point2f>(went);
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
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  const cv::Vec3f texture = mean_texture(pyramid_, {x, y}, kTextureRadiusPx);
  sample.texture = {texture[0], texture[1], texture[2]};
  if (!frame.depth.empty()) {
    const float unit = static_cast<float>(1 / camera_.depth_units_per_m);
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
  const auto offer = [&](const cv::Point2f& p) {
    if (static_cast<int>(tracks_.size()) >= options_.tracks || !is_inside(p)) return;
    if (is_masked(frame.excluded, p) && !is_masked(frame.watched, p)) return;
    if (count[cell_of(p)] >= per_cell || !occupied.take(p.x, p.y)) return;
    ++count[cell_of(p)];
    tracks_.emplace_back(PointTrackId(next_id_++));
    tracks_.back().push(make_sample(frame, {p.x, p.y}));
  };
  // The caller's corners may leave out what is watched: it comes first, the rest is always enough.
  const bool search_all = frame.corners.empty();
  const int wanted = search_all ? per_cell : 1;  // the search costs more than following what it finds
  std::vector<cv::KeyPoint> corners;
  cv::Mat strength;
  for (int row = 0; row < rows && (search_all || !frame.watched.empty()); ++row)
    for (int column = 0; column < columns; ++column) {
      if (count[static_cast<std::size_t>(row * columns + column)] >= wanted) continue;
      const cv::Point2f middle((static_cast<float>(column) + 0.5f) * static_cast<float>(cell),
                               (static_cast<float>(row) + 0.5f) * static_cast<float>(cell));
      if (!search_all && !is_masked(frame.watched, middle)) continue;
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
  for (const cv::Point2f& p : frame.corners) offer(p);
}

}  // namespace semvslam
