#include "semvslam/motion/moving_regions.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "semvslam/base/ranked.h"

namespace semvslam {
namespace {

constexpr double kSeedsPerTrack = 4;    // so many depth seeds are as good as a moving track
constexpr int kSeedsAlone = 24;         // so many make a region without any moving track
constexpr int kLeastSeeds = 2;          // fewer: the depth says nothing of a moving thing, and the tracks need ...
constexpr int kTracksAlone = 5;         // ... to be so many times as many
constexpr int kLeastHoldingLength = 4;  // frames a track must have been at rest to hold a region back
constexpr int kLeastMovingFrames = 3;   // in a row that a point must have moved to found a region
constexpr double kMergeShare = 0.5;     // of the smaller region's mask inside the larger: they are one

float squared_distance(const cv::Point2f& a, const cv::Point2f& b) {
  const cv::Point2f d = a - b;
  return d.dot(d);
}

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) {
    a = root(a), b = root(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace

std::string_view to_string(RegionState state) {
  switch (state) {
    case RegionState::kMoving:
      return "moving";
    case RegionState::kPaused:
      return "paused";
  }
  return "";
}

void MovingRegionOptions::add_to(ConfigSchema& schema) {
  schema.add("motion.region.min_tracks", &min_tracks, {1, 100}, "moving points that make an unknown moving object");
  schema.add("motion.region.cluster_px", &cluster_px, {5.0, 500.0}, "points farther apart are different objects, px");
  schema.add("motion.region.cluster_m", &cluster_m, {0.01, 5.0}, "points farther apart are different objects, m");
  schema.add("motion.region.margin_px", &margin_px, {0.0, 200.0}, "an object may reach so far beyond its points, px");
  schema.add("motion.region.hold_s", &hold_s, {0.0, 60.0}, "an object is not trusted for so long after it stopped, s");
  schema.add("motion.region.depth_seeds", &depth_seeds, "look for moving surfaces in depth too, not only for points");
  schema.add("motion.region.seed_step_px", &seed_step_px, {2, 64}, "raster on which they are looked for, px");
}

MovingRegions::MovingRegions(const Camera& camera, const MovingRegionOptions& options,
                             const MotionCheckOptions& check_options)
    : camera_(camera), options_(options), depth_seeds_(camera, check_options, options.seed_step_px) {
  mask_ = cv::Mat::zeros(camera.height_px, camera.width_px, CV_8UC1);
}

void MovingRegions::reset() {
  regions_.clear();
  kept_.clear();
  depth_seeds_.reset();
  mask_ = cv::Mat::zeros(camera_.height_px, camera_.width_px, CV_8UC1);
}

bool MovingRegions::is_unclaimed(const MotionFrame& frame, const cv::Point2f& pixel) const {
  const int x = std::clamp(static_cast<int>(std::lround(pixel.x)), 0, camera_.width_px - 1);
  const int y = std::clamp(static_cast<int>(std::lround(pixel.y)), 0, camera_.height_px - 1);
  return (frame.excluded.empty() || !frame.excluded.at<std::uint8_t>(y, x)) &&
         (frame.instances.empty() || !frame.instances.at<std::uint16_t>(y, x));
}

std::vector<MovingRegions::Evidence> MovingRegions::collect(const MotionFrame& frame, std::span<const FlowTrack> tracks,
                                                            const MotionCheckResult& motion) {
  std::vector<Evidence> evidence;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (motion.tracks[i].verdict != MotionVerdict::kMoving) continue;
    const TrackSample& sample = tracks[i].newest();
    const cv::Point2f pixel(sample.pixel.x(), sample.pixel.y());
    if (sample.excluded || !is_unclaimed(frame, pixel)) continue;
    evidence.push_back({pixel, sample.depth_m, tracks[i].id(), motion.tracks[i].velocity_m_s,
                        motion.tracks[i].moving_frames, sample.depth_spread_m});
  }
  if (!options_.depth_seeds) return evidence;
  const CameraMotion& camera = motion.camera;
  const bool trusted = camera.source == CameraMotionSource::kEstimated || camera.source == CameraMotionSource::kGiven;
  for (const DepthSeed& seed :
       depth_seeds_.step(frame.depth, trusted ? std::optional(camera.cur_from_prev) : std::nullopt)) {
    const cv::Point2f pixel(seed.pixel);
    if (is_unclaimed(frame, pixel)) evidence.push_back({pixel, seed.depth_m, PointTrackId(), Eigen::Vector3f::Zero()});
  }
  return evidence;
}

bool MovingRegions::belong_together(const Evidence& a, const Evidence& b) const {
  const double limit_px = options_.cluster_px;
  if (squared_distance(a.pixel, b.pixel) > limit_px * limit_px) return false;
  if (a.depth_m > 0 && b.depth_m > 0) {
    const Eigen::Vector3d pa = camera_.back_project({a.pixel.x, a.pixel.y}, a.depth_m);
    const Eigen::Vector3d pb = camera_.back_project({b.pixel.x, b.pixel.y}, b.depth_m);
    if ((pa - pb).norm() > options_.cluster_m) return false;
  }
  // Parts of one thing move alike, if not equally: limbs and turning things differ by about their own speed.
  if (a.track.valid() && b.track.valid()) {
    const float faster = std::max(a.velocity_m_s.norm(), b.velocity_m_s.norm());
    if ((a.velocity_m_s - b.velocity_m_s).norm() > 0.3f + faster) return false;
  }
  return true;
}

bool MovingRegions::move_alike(std::span<const Evidence> evidence) const {
  constexpr float kUnlike = 0.5f;  // of the mean speed
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const Evidence& e : evidence) mean += e.velocity_m_s / static_cast<float>(evidence.size());
  const auto alike = std::count_if(evidence.begin(), evidence.end(), [&](const Evidence& e) {
    return (e.velocity_m_s - mean).norm() < kUnlike * mean.norm();
  });
  return 3 * alike >= 2 * static_cast<std::ptrdiff_t>(evidence.size());
}

bool MovingRegions::rests(std::span<const Evidence> evidence, std::span<const FlowTrack> tracks,
                          const MotionCheckResult& motion) const {
  constexpr float kAroundPx = 8;
  std::vector<cv::Point2f> points, hull;
  std::vector<float> depths;
  double moving = 0;
  for (const Evidence& e : evidence) {
    for (const float dx : {-kAroundPx, kAroundPx})
      for (const float dy : {-kAroundPx, kAroundPx}) points.emplace_back(e.pixel.x + dx, e.pixel.y + dy);
    if (e.depth_m > 0) depths.push_back(e.depth_m);
    moving += e.track.valid() ? 1 : 1 / kSeedsPerTrack;
  }
  cv::convexHull(points, hull);
  int at_rest = 0;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const TrackSample& sample = tracks[i].newest();
    if (motion.tracks[i].verdict != MotionVerdict::kStatic || tracks[i].length() < kLeastHoldingLength) continue;
    if (cv::pointPolygonTest(hull, {sample.pixel.x(), sample.pixel.y()}, false) < 0) continue;
    const auto alike = [&](float depth_m) { return std::abs(depth_m - sample.depth_m) < options_.cluster_m; };
    at_rest += depths.empty() || std::any_of(depths.begin(), depths.end(), alike);
  }
  return at_rest > moving;
}

void MovingRegions::assign(const MotionFrame& frame, std::span<const FlowTrack> tracks, const MotionCheckResult& motion,
                           const std::vector<Evidence>& evidence) {
  for (Kept& kept : kept_) kept.fresh.clear();
  std::vector<Evidence> loose;
  for (const Evidence& e : evidence) {
    Kept* home = nullptr;
    for (Kept& kept : kept_) {
      const bool member = e.track.valid() && kept.members.contains(e.track);
      if (member || kept.cells.data[grid_.cell_of(e.pixel)]) {
        home = &kept;
        break;
      }
    }
    if (!home)
      for (Kept& kept : kept_)
        if (std::any_of(kept.anchors.begin(), kept.anchors.end(),
                        [&](const Evidence& a) { return belong_together(a, e); })) {
          home = &kept;
          break;
        }
    if (home)
      home->fresh.push_back(e);
    else
      loose.push_back(e);
  }
  // A verdict of a single frame may be chance.
  std::erase_if(loose, [](const Evidence& e) { return e.track.valid() && e.moving_frames < kLeastMovingFrames; });
  DisjointSets sets(loose.size());
  for (std::size_t i = 0; i < loose.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (belong_together(loose[i], loose[k])) sets.join(i, k);
  for (std::size_t root = 0; root < loose.size(); ++root) {
    if (sets.root(root) != root) continue;
    Kept fresh;
    double moving = 0, seeds = 0;
    for (std::size_t i = root; i < loose.size(); ++i)
      if (sets.root(i) == root) {
        fresh.fresh.push_back(loose[i]);
        (loose[i].track.valid() ? moving : seeds) += 1;
      }
    // Reflections on glossy things move as well, but no surface with them.
    const double needed = options_.min_tracks * (options_.depth_seeds && seeds < kLeastSeeds ? kTracksAlone : 1);
    const bool enough = moving > 0 ? moving + seeds / kSeedsPerTrack >= needed : seeds >= kSeedsAlone;
    if (options_.depth_seeds && seeds < kLeastSeeds && !move_alike(fresh.fresh)) continue;
    if (!enough || rests(fresh.fresh, tracks, motion)) continue;
    fresh.region.id = RegionId(next_id_++);
    fresh.region.moved_at_s = frame.time_s;
    fresh.cells = cv::Mat::zeros(grid_.rows, grid_.columns, CV_8UC1);
    kept_.push_back(std::move(fresh));
  }
}

void MovingRegions::carry(const MotionFrame& frame, const CellGrid& before, const MotionCheckResult& motion) {
  const bool moved = motion.camera.source != CameraMotionSource::kNone;
  const SE3& cur_from_prev = motion.camera.cur_from_prev;
  for (Kept& kept : kept_) {
    if (!moved || kept.cells.empty()) continue;
    const double step_s = std::clamp(frame.time_s - last_time_s_, 0.0, 0.2);
    const Eigen::Vector3d shift = kept.region.state == RegionState::kMoving
                                      ? Eigen::Vector3d(kept.region.velocity_m_s.cast<double>() * step_s)
                                      : Eigen::Vector3d::Zero();
    cv::Mat cells = cv::Mat::zeros(grid_.rows, grid_.columns, CV_8UC1);
    for (int cell = 0; cell < static_cast<int>(before.size()); ++cell) {
      if (!kept.cells.data[cell]) continue;
      const float measured = before.depth_m[static_cast<std::size_t>(cell)];
      const double z = measured > 0 ? measured : kept.region.depth_m > 0 ? kept.region.depth_m : 2.0;
      const cv::Point2f pixel = before.centre(cell);
      const Eigen::Vector3d p = cur_from_prev * camera_.back_project({pixel.x, pixel.y}, z) + shift;
      if (p.z() < 0.1) continue;
      const Eigen::Vector2d to = camera_.project(p);
      if (to.x() >= 0 && to.y() >= 0 && to.x() < camera_.width_px && to.y() < camera_.height_px)
        cells.data[grid_.cell_of({static_cast<float>(to.x()), static_cast<float>(to.y())})] = 255;
    }
    cv::morphologyEx(cells, kept.cells, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  }
}

std::vector<MovingRegions::Evidence> MovingRegions::without_strays(const std::vector<Evidence>& anchors) const {
  DisjointSets sets(anchors.size());
  for (std::size_t i = 0; i < anchors.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (sets.root(i) != sets.root(k) && belong_together(anchors[i], anchors[k])) sets.join(i, k);
  std::vector<double> weight(anchors.size(), 0);
  for (std::size_t i = 0; i < anchors.size(); ++i)
    weight[sets.root(i)] += anchors[i].track.valid() ? 1 : 1 / kSeedsPerTrack;
  std::vector<Evidence> kept;
  for (std::size_t i = 0; i < anchors.size(); ++i)
    if (weight[sets.root(i)] >= options_.min_tracks) kept.push_back(anchors[i]);
  return kept;
}

void MovingRegions::update(Kept& kept, const MotionFrame& frame, std::span<const FlowTrack> tracks,
                           const MotionCheckResult& motion) {
  MovingRegion& region = kept.region;
  int moving = 0, seeds = 0;
  std::vector<float> depths;
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();
  for (const Evidence& e : kept.fresh) {
    if (e.track.valid()) {
      kept.members[e.track] = frame.time_s;
      velocity += e.velocity_m_s;
    }
    (e.track.valid() ? moving : seeds) += 1;
    if (e.depth_m > 0) depths.push_back(e.depth_m);
  }
  region.tracks = moving;
  region.seeds = seeds;
  const int needed = std::max(1, options_.min_tracks - 1);
  const bool moves = moving + seeds / kSeedsPerTrack >= needed && !rests(kept.fresh, tracks, motion);
  if (moves) region.moved_at_s = frame.time_s;
  region.state = moves ? RegionState::kMoving : RegionState::kPaused;
  if (moving > 0) region.velocity_m_s = velocity / static_cast<float>(moving);

  std::vector<GrowthSeed> from, against;
  kept.anchors = kept.fresh;
  std::unordered_map<PointTrackId, double> alive;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const TrackSample& sample = tracks[i].newest();
    const cv::Point2f pixel(sample.pixel.x(), sample.pixel.y());
    const auto member = kept.members.find(tracks[i].id());
    const bool at_rest =
        motion.tracks[i].verdict == MotionVerdict::kStatic && tracks[i].length() >= kLeastHoldingLength;
    if (member != kept.members.end() && frame.time_s - member->second <= options_.hold_s) {
      alive.insert(*member);
      if (member->second < frame.time_s) {  // not among the fresh ones
        kept.anchors.push_back({pixel, sample.depth_m, tracks[i].id(), region.velocity_m_s});
        if (sample.depth_m > 0) depths.push_back(sample.depth_m);
      }
    } else if (at_rest && (moves || !kept.cells.data[grid_.cell_of(pixel)])) {
      against.push_back({pixel, sample.depth_m});
    }
  }
  kept.members = std::move(alive);
  if (!depths.empty()) region.depth_m = median(std::span(depths));
  for (const Evidence& e : without_strays(kept.anchors)) {
    // At an edge of depth it is open which side a track belongs to.
    const bool edge = e.depth_spread_m > 0.05f * e.depth_m;
    if (edge && region.depth_m > 0 && std::abs(e.depth_m - region.depth_m) > options_.cluster_m) continue;
    from.push_back({e.pixel, e.depth_m});
  }
  // Where the region was before it still is, as long as the depth says so; that keeps smooth surfaces without points.
  cv::Mat held = cv::Mat::zeros(grid_.rows, grid_.columns, CV_8UC1);
  for (int cell = 0; cell < static_cast<int>(grid_.size()); ++cell)
    if (kept.cells.data[cell] &&
        std::abs(grid_.depth_m[static_cast<std::size_t>(cell)] - region.depth_m) < options_.cluster_m)
      held.data[cell] = 255;
  GrowthLimits limits;
  limits.margin_px = options_.margin_px;
  limits.bridge_px = options_.cluster_px;
  limits.reach_m = options_.cluster_m;
  if (from.empty()) {
    kept.cells = held;
    return;
  }
  cv::Mat grown = grow_region(grid_, from, against, limits);
  if (!moves) cv::bitwise_or(grown, held, grown);
  cv::morphologyEx(grown, kept.cells, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
}

void MovingRegions::merge() {
  for (std::size_t a = 0; a < kept_.size(); ++a)
    for (std::size_t b = a + 1; b < kept_.size();) {
      const int size_a = cv::countNonZero(kept_[a].cells), size_b = cv::countNonZero(kept_[b].cells);
      const int both = cv::countNonZero(kept_[a].cells & kept_[b].cells);
      if (both == 0 || both < kMergeShare * std::min(size_a, size_b)) {
        ++b;
        continue;
      }
      // The elder keeps its id.
      Kept &elder = kept_[a], &younger = kept_[b];
      elder.cells |= younger.cells;
      elder.members.insert(younger.members.begin(), younger.members.end());
      elder.anchors.insert(elder.anchors.end(), younger.anchors.begin(), younger.anchors.end());
      elder.region.tracks += younger.region.tracks;
      elder.region.seeds += younger.region.seeds;
      elder.region.moved_at_s = std::max(elder.region.moved_at_s, younger.region.moved_at_s);
      if (younger.region.state == RegionState::kMoving) elder.region.state = RegionState::kMoving;
      kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(b));
    }
}

void MovingRegions::draw() {
  regions_.clear();
  mask_ = masks_.take_zeros({camera_.width_px, camera_.height_px}, CV_8UC1);  // results given out share the old one
  for (Kept& kept : kept_) {
    const cv::Rect cells = cv::boundingRect(kept.cells);
    if (cells.empty()) continue;
    constexpr int kPx = CellGrid::kCellPx;
    MovingRegion region = kept.region;
    region.window =
        cv::Rect(cells.x * kPx, cells.y * kPx, cells.width * kPx, cells.height * kPx) & cv::Rect({0, 0}, mask_.size());
    cv::Mat large;
    cv::resize(kept.cells(cells), large, {}, kPx, kPx, cv::INTER_NEAREST);
    region.mask = large(cv::Rect({0, 0}, region.window.size())).clone();
    mask_(region.window).setTo(255, region.mask);
    regions_.push_back(std::move(region));
  }
}

void MovingRegions::step(const MotionFrame& frame, std::span<const FlowTrack> tracks, const MotionCheckResult& motion) {
  if (tracks.size() != motion.tracks.size())
    throw std::invalid_argument("moving regions: one verdict per track is needed");
  const std::vector<Evidence> evidence = collect(frame, tracks, motion);
  if (evidence.empty() && kept_.empty()) {
    if (!regions_.empty()) draw();
    last_time_s_ = frame.time_s;
    return;
  }
  const CellGrid before = std::move(grid_);
  grid_ = CellGrid(camera_, frame.depth);
  if (!kept_.empty()) carry(frame, before, motion);
  assign(frame, tracks, motion, evidence);
  for (Kept& kept : kept_) update(kept, frame, tracks, motion);
  merge();
  std::erase_if(kept_, [&](const Kept& kept) {
    return frame.time_s - kept.region.moved_at_s > options_.hold_s || cv::countNonZero(kept.cells) == 0;
  });
  draw();
  last_time_s_ = frame.time_s;
}

std::vector<InstanceMotion> count_instance_motion(std::span<const TrackMotion> motion,
                                                  std::span<const std::uint16_t> instances, std::size_t count) {
  if (instances.size() != motion.size())
    throw std::invalid_argument("instance motion: one verdict per track is needed");
  std::vector<InstanceMotion> counts(count);
  for (std::size_t i = 0; i < count; ++i) counts[i].instance = InstanceId(static_cast<std::uint32_t>(i));
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const std::size_t label = instances[i];
    if (label == 0 || label > count) continue;
    InstanceMotion& target = counts[label - 1];
    target.moving += motion[i].verdict == MotionVerdict::kMoving;
    target.at_rest += motion[i].verdict == MotionVerdict::kStatic;
    target.unknown += motion[i].verdict == MotionVerdict::kUnknown;
  }
  return counts;
}

}  // namespace semvslam
