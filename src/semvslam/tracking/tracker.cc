#include "semvslam/tracking/tracker.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "semvslam/geometry/mask_lookup.h"

namespace semvslam {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr double kNearestProjection = 0.05;  // metres before the camera
constexpr double kLeastUsedShare = 0.5;      // of the features: no more than twice as many are extracted
constexpr std::size_t kLeastToSearch = 50;   // features by which a lost frame can be found
/// After more lost frames than these the camera may be anywhere. From a wrong pose some dozens of landmarks are found
/// as well, on things that look alike, but few of all that should be in view; at right ones the median is a quarter.
constexpr int kBrieflyLost = 5;
constexpr double kFoundAgainShare = 0.1;
constexpr int kMostFramesOffMap = 30;                   // in a row, of a camera that is only localised
constexpr double kMapJumpM = 0.01, kMapJumpRad = 0.01;  // more than a local bundle adjustment moves the newest frame

}  // namespace

void Tracker::Candidates::clear() {
  points.clear();
  observations.clear();
  features.clear();
  landmarks.clear();
}

Tracker::Tracker(const TrackingOptions& options, const OrbOptions& orb, const DynamicOptions& dynamic,
                 std::shared_ptr<const ObservationModel> model, MapUse use)
    : options_(options),
      use_(use),
      model_(std::move(model)),
      extractor_(orb),
      orb_features_(orb.features),
      filter_(model_->camera(), dynamic) {}

Tracker::Output Tracker::step(const RgbdFrame& frame, const Segmentation* segmentation,
                              std::shared_ptr<const LocalMap> local, bool may_request, bool may_begin) {
  const Clock::time_point start = Clock::now();
  Output output;
  observe(frame, segmentation, output.times);
  if (local) {
    adopt(std::move(local));
    estimate(frame, may_request, output);
  } else if (use_ != MapUse::kBuild) {
    lose(frame.id, output);
  } else if (!waiting_for_map_) {
    initialise(frame, output);
  }
  if (output.state == TrackingState::kLost && may_begin && use_ != MapUse::kFollow) begin_anew(frame, output);
  const bool tracked = output.state == TrackingState::kTracking;
  filter_.end(tracked ? std::optional<SE3>(output.camera_from_world) : std::nullopt, is_tracked_);
  output.dynamic = filter_.record();
  output.times.total_ms = ms_since(start);
  return output;
}

void Tracker::observe(const RgbdFrame& frame, const Segmentation* segmentation, TrackingTimes& times) {
  Clock::time_point lap = Clock::now();
  const auto take_lap = [&lap] {
    const double ms = ms_since(lap);
    lap = Clock::now();
    return ms;
  };
  current_ = Tracked{std::make_shared<FrameFeatures>(), {}, {}};
  FrameFeatures& features = *current_.features;
  filter_.begin(frame, segmentation, has_velocity_ ? std::optional<SE3>(velocity_) : std::nullopt);
  times.dynamic_ms = take_lap();
  int with_depth = 0;
  do {
    extractor_.extract(frame.gray, filter_.excluded(), features.orb);
    measure(*model_, frame.depth, features);
    with_depth = static_cast<int>(
        std::count_if(features.depth_m.begin(), features.depth_m.end(), [](float depth_m) { return depth_m > 0; }));
  } while (filter_.relax(with_depth));
  times.extract_ms = take_lap();
  pixels_.clear();
  for (const Keypoint& k : features.orb.keypoints) pixels_.emplace_back(k.x_px, k.y_px);
  const std::vector<std::uint8_t>& use = filter_.judge(pixels_, features.depth_m);
  for (std::size_t i = 0; i < use.size(); ++i)
    if (use[i] == kKnownLandmarkOnly) features.depth_m[i] = 0;  // landmarks and temporary points begin with a depth
  share_features(static_cast<std::size_t>(std::count(use.begin(), use.end(), kFullyUsed)), use.size());
  keep_features(use, model_->camera(), features);
  current_.landmarks.assign(features.size(), LandmarkId());
  is_tracked_.assign(features.size(), 0);
  times.dynamic_ms += take_lap();
}

void Tracker::share_features(std::size_t used, std::size_t extracted) {
  // What moves and is in no mask takes features that the static scene lacks; the next image gets as many more.
  const double share = extracted == 0 ? 1 : static_cast<double>(used) / static_cast<double>(extracted);
  extractor_.set_budget(static_cast<int>(std::lround(orb_features_ / std::max(share, kLeastUsedShare))));
}

void Tracker::estimate(const RgbdFrame& frame, bool may_request, Output& output) {
  const Clock::time_point start = Clock::now();
  bool ok = false;
  if (last_.features) {
    if (has_velocity_)
      ok = track_motion(velocity_ * last_.camera_from_world, 1.0) ||
           track_motion(velocity_ * last_.camera_from_world, 2.5);
    if (!ok) ok = track_motion(last_.camera_from_world, has_velocity_ ? 4.0 : 2.0);
  }
  if (!ok) ok = track_descriptors();
  output.times.frame_ms = ms_since(start);

  const Clock::time_point local_start = Clock::now();
  if (ok) {
    std::swap(candidates_, frame_matches_);
    output.inliers = track_local_map(frame);
    // Found again after it was lost, a frame must agree with the map: what it was matched against may be long ago.
    const bool on_map = output.inliers >= options_.min_inliers;
    if (!on_map && has_velocity_ && may_leave_map()) output.inliers = keep_frame_matches();
    frames_off_map_ = on_map ? 0 : frames_off_map_ + 1;
    ok = output.inliers >= options_.min_inliers;
  }
  output.times.local_map_ms = ms_since(local_start);

  if (ok) {
    output.state = TrackingState::kTracking;
    output.camera_from_world = current_.camera_from_world;
    const SE3 reference = local_->find(local_->reference)->camera_from_world;
    last_relative_ = output.relative =
        RelativePose{local_->reference, current_.camera_from_world * reference.inverse()};
    has_velocity_ = last_.features != nullptr;
    if (has_velocity_) velocity_ = current_.camera_from_world * last_.camera_from_world.inverse();
    if (may_request && use_ == MapUse::kFollow)
      output.local_map = wants_local_map(frame.id);
    else if (may_request && wants_key_frame(output.inliers, frame.id))
      output.key_frame = make_request(frame);
    last_ = std::move(current_);
    lost_frames_ = 0;
  } else {
    lose(frame.id, output);
  }
}

void Tracker::lose(FrameId frame, Output& output) {
  ++lost_frames_;
  output.state = TrackingState::kLost;
  if (current_.features->size() >= kLeastToSearch) output.search = SearchRequest{frame, current_.features};
  output.camera_from_world = last_.camera_from_world;
  has_velocity_ = false;  // the last frame stays what the next one is matched against
}

bool Tracker::resume(const FoundAgain& found) {
  if (lost_frames_ == 0) return false;
  const LocalMap::KeyFramePose& reference = *found.local->find(found.relative.reference);
  last_ = {found.features, found.landmarks, found.relative.camera_from_reference * reference.camera_from_world};
  last_relative_ = found.relative;
  // A key frame is due here, and none is pending: those before were worked off before the search.
  last_request_ = found.local->reference_frame;
  asked_reference_ = found.local->reference;
  filter_.forget_poses();
  return true;
}

void Tracker::initialise(const RgbdFrame& frame, Output& output) {
  int with_depth = 0;
  for (std::size_t i = 0; i < current_.features->size(); ++i) with_depth += current_.features->has_depth(i);
  if (with_depth < options_.min_initial_points) return;
  output.state = TrackingState::kTracking;
  output.inliers = with_depth;
  last_relative_.reset();
  output.key_frame = make_request(frame);
  waiting_for_map_ = true;
  last_ = std::move(current_);
}

void Tracker::begin_anew(const RgbdFrame& frame, Output& output) {
  // What it was taken for before it counted as lost is void.
  current_.camera_from_world = SE3();
  current_.landmarks.assign(current_.features->size(), LandmarkId());
  is_tracked_.assign(current_.features->size(), 0);
  initialise(frame, output);
  if (output.state == TrackingState::kLost) return;
  output.camera_from_world = last_.camera_from_world;
  output.search.reset();
  lost_frames_ = frames_off_map_ = 0;
  filter_.forget_poses();
}

void Tracker::adopt(std::shared_ptr<const LocalMap> local) {
  if (local == local_) return;
  local_ = std::move(local);
  if (!last_.features) return;
  if (last_relative_) {
    if (const LocalMap::KeyFramePose* reference = local_->find(last_relative_->reference)) {
      const SE3 before = last_.camera_from_world;
      last_.camera_from_world = last_relative_->camera_from_reference * reference->camera_from_world;
      // Where mapping has removed drift, still things have moved in the world.
      const SE3 shift = last_.camera_from_world * before.inverse();
      if (shift.translation().norm() > kMapJumpM || shift.rotation_angle_rad() > kMapJumpRad) filter_.forget_poses();
    }
  }
  for (LandmarkId& id : last_.landmarks) {
    if (!id.valid()) continue;
    const auto it = std::lower_bound(local_->fused.begin(), local_->fused.end(), std::pair(id, LandmarkId(0)));
    if (it != local_->fused.end() && it->first == id) id = it->second;
  }
}

bool Tracker::track_motion(const SE3& predicted, double radius_factor) {
  const Camera& camera = model_->camera();
  const FrameFeatures& last = *last_.features;
  const SE3 world_from_last = last_.camera_from_world.inverse();
  queries_.clear();
  query_source_.clear();
  std::vector<Eigen::Vector3d>& points = candidates_.points;
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(last.size());
  for (std::size_t i = 0; i < last.size(); ++i) {
    Eigen::Vector3d in_world;
    if (const LocalMap::Point* point = last_.landmarks[i].valid() ? local_->find(last_.landmarks[i]) : nullptr)
      in_world = point->position;
    else if (last.has_depth(i))
      in_world = world_from_last * model_->back_project(last, i);
    else
      continue;
    const Eigen::Vector3d in_camera = predicted * in_world;
    if (in_camera.z() < kNearestProjection) continue;
    const Eigen::Vector2d pixel = camera.project(in_camera);
    if (!camera.sees(pixel)) continue;
    const Keypoint& keypoint = last.orb.keypoints[i];
    const float radius =
        static_cast<float>(options_.motion_radius_px * radius_factor) * model_->level_scale(keypoint.level);
    queries_.push_back({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), radius, keypoint.level - 1,
                        keypoint.level + 1, last.orb.descriptors[i], keypoint.angle_rad});
    query_source_.push_back(static_cast<int>(i));
    positions.push_back(in_world);
  }
  match_projected(queries_, current_.features->orb, current_.features->grid,
                  {.max_distance = options_.max_distance_bits, .ratio = 0.9f, .check_rotation = true}, matches_);
  candidates_.clear();
  for (const Match& m : matches_) {
    const int source = query_source_[static_cast<std::size_t>(m.query)];
    points.push_back(positions[static_cast<std::size_t>(m.query)]);
    candidates_.observations.push_back(model_->observation(*current_.features, static_cast<std::size_t>(m.feature)));
    candidates_.features.push_back(m.feature);
    const LandmarkId id = last_.landmarks[static_cast<std::size_t>(source)];
    candidates_.landmarks.push_back(id.valid() && local_->find(id) ? id : LandmarkId());
  }
  SE3 pose = predicted;
  const int inliers = estimate_pose(candidates_, pose);
  if (inliers < options_.min_inliers) return false;
  current_.camera_from_world = pose;
  return true;
}

bool Tracker::track_descriptors() {
  // Last resort when prediction fails: the previous frame's points against the whole image, by descriptor alone.
  if (!last_.features) return false;
  const FrameFeatures& last = *last_.features;
  const SE3 world_from_last = last_.camera_from_world.inverse();
  match_brute_force(last.orb.descriptors, current_.features->orb.descriptors, {.max_distance = 50, .ratio = 0.8f},
                    matches_);
  candidates_.clear();
  for (const Match& m : matches_) {
    const auto i = static_cast<std::size_t>(m.query);
    const LocalMap::Point* point = last_.landmarks[i].valid() ? local_->find(last_.landmarks[i]) : nullptr;
    if (!point && !last.has_depth(i)) continue;
    candidates_.points.push_back(point ? point->position : world_from_last * model_->back_project(last, i));
    candidates_.observations.push_back(model_->observation(*current_.features, static_cast<std::size_t>(m.feature)));
    candidates_.features.push_back(m.feature);
    candidates_.landmarks.push_back(point ? point->id : LandmarkId());
  }
  SE3 pose = last_.camera_from_world;
  if (estimate_pose(candidates_, pose) < options_.min_inliers) return false;
  current_.camera_from_world = pose;
  return true;
}

int Tracker::estimate_pose(Candidates& candidates, SE3& camera_from_world) {
  if (candidates.points.size() < 10) return 0;
  const PoseEstimate estimate =
      optimize_pose(model_->intrinsics(), camera_from_world, candidates.points, candidates.observations,
                    {.chi2_disparity = model_->chi2_disparity()}, inlier_);
  camera_from_world = estimate.camera_from_world;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidates.points.size(); ++i) {
    if (!inlier_[i]) continue;
    candidates.points[kept] = candidates.points[i];
    candidates.observations[kept] = candidates.observations[i];
    candidates.features[kept] = candidates.features[i];
    candidates.landmarks[kept] = candidates.landmarks[i];
    ++kept;
  }
  candidates.points.resize(kept);
  candidates.observations.resize(kept);
  candidates.features.resize(kept);
  candidates.landmarks.resize(kept);
  return estimate.inliers;
}

int Tracker::track_local_map(const RgbdFrame& frame) {
  const LandmarkViewer viewer(*model_, current_.camera_from_world, options_.min_view_cosine);
  std::vector<LandmarkId> visible, found;
  queries_.clear();
  query_source_.clear();
  for (std::size_t k = 0; k < local_->points.size(); ++k) {
    const LocalMap::Point& point = local_->points[k];
    const std::optional<LandmarkView> view =
        viewer.view({point.position, point.normal, point.min_distance_m, point.max_distance_m});
    if (!view) continue;
    // What the depth says decides on the landmark's fate only, not on whether it is searched: depth and landmark are
    // both off at times, the descriptor has the last word.
    const SurfaceCheck surface = look_at(frame, *view);
    if (surface == SurfaceCheck::kSeenThrough)
      ++uses_[point.id].seen_through;
    else if (surface != SurfaceCheck::kHidden)
      visible.push_back(point.id);
    queries_.push_back(query_of(*model_, *view, options_.local_map_radius_px, point.descriptor));
    query_source_.push_back(static_cast<int>(k));
  }
  match_projected(queries_, current_.features->orb, current_.features->grid,
                  {.max_distance = options_.max_distance_bits, .ratio = 0.8f, .check_rotation = false}, matches_);
  candidates_.clear();
  for (const Match& m : matches_) {
    const LocalMap::Point& point =
        local_->points[static_cast<std::size_t>(query_source_[static_cast<std::size_t>(m.query)])];
    candidates_.points.push_back(point.position);
    candidates_.observations.push_back(model_->observation(*current_.features, static_cast<std::size_t>(m.feature)));
    candidates_.features.push_back(m.feature);
    candidates_.landmarks.push_back(point.id);
  }
  SE3 refined = current_.camera_from_world;
  const int inliers = estimate_pose(candidates_, refined);
  if (inliers < options_.min_inliers) return inliers;
  if (lost_frames_ > kBrieflyLost && inliers < kFoundAgainShare * static_cast<double>(queries_.size())) return 0;
  current_.camera_from_world = refined;
  for (std::size_t i = 0; i < candidates_.points.size(); ++i) {
    const auto feature = static_cast<std::size_t>(candidates_.features[i]);
    current_.landmarks[feature] = candidates_.landmarks[i];
    is_tracked_[feature] = 1;
    found.push_back(candidates_.landmarks[i]);
  }
  count_uses(visible, found);
  return inliers;
}

int Tracker::keep_frame_matches() {
  std::vector<LandmarkId> found;
  for (std::size_t i = 0; i < frame_matches_.features.size(); ++i) {
    const auto feature = static_cast<std::size_t>(frame_matches_.features[i]);
    is_tracked_[feature] = 1;
    if (!frame_matches_.landmarks[i].valid()) continue;
    current_.landmarks[feature] = frame_matches_.landmarks[i];
    found.push_back(frame_matches_.landmarks[i]);
  }
  count_uses({}, found);
  return static_cast<int>(frame_matches_.features.size());
}

bool Tracker::may_leave_map() const { return use_ != MapUse::kFollow || frames_off_map_ < kMostFramesOffMap; }

SurfaceCheck Tracker::look_at(const RgbdFrame& frame, const LandmarkView& view) const {
  const Camera& camera = model_->camera();
  if (const cv::Mat& excluded = filter_.excluded(); !excluded.empty()) {
    const Eigen::Vector2d recorded = camera.distortion.is_zero() ? view.pixel : camera.distort(view.pixel);
    if (is_masked(excluded, cv::Point2d(recorded.x(), recorded.y()))) return SurfaceCheck::kHidden;
  }
  return check_surface(camera, frame.depth, view.pixel, view.in_camera.z());
}

void Tracker::count_uses(const std::vector<LandmarkId>& visible, const std::vector<LandmarkId>& found) {
  for (const LandmarkId id : visible) ++uses_[id].visible;
  for (const LandmarkId id : found) {
    LandmarkUse& use = uses_[id];
    ++use.found;
    use.visible = std::max(use.visible, use.found);
  }
}

bool Tracker::wants_key_frame(int inliers, FrameId frame) const {
  const int since = frames_since_request(frame);
  const bool almost_lost = inliers < 0.5 * options_.key_frame_ratio * local_->reference_matches;
  if (since < options_.min_frames_between) return almost_lost;
  // While mapping still works on the last request the snapshot cannot know what that one will bring: only a view that
  // is about to get lost is worth another.
  const bool pending = local_->reference_frame != last_request_;
  if (pending) return almost_lost;
  int tracked_close = 0, new_close = 0;
  for (std::size_t i = 0; i < current_.features->size(); ++i) {
    const float depth = current_.features->depth_m[i];
    if (depth <= 0.f || depth > options_.close_depth_m) continue;
    (current_.landmarks[i].valid() ? tracked_close : new_close) += 1;
  }
  const bool needs_close = tracked_close < options_.min_tracked_close && new_close > options_.min_new_close;
  const bool weak = inliers < options_.key_frame_ratio * local_->reference_matches || needs_close;
  return since >= options_.max_frames_between || weak;
}

std::optional<LocalMapRequest> Tracker::wants_local_map(FrameId frame) {
  uses_.clear();  // nobody will ask how the landmarks fared
  const bool pending = local_->reference != asked_reference_;
  if (pending || frames_since_request(frame) < options_.min_frames_between) return std::nullopt;
  const KeyFrameId nearest = local_->nearest(current_.camera_from_world);
  if (nearest == local_->reference) return std::nullopt;
  last_request_ = frame;
  asked_reference_ = nearest;
  return LocalMapRequest{nearest};
}

int Tracker::frames_since_request(FrameId frame) const {
  return last_request_.valid() ? static_cast<int>(frame.value - last_request_.value) : std::numeric_limits<int>::max();
}

KeyFrameRequest Tracker::make_request(const RgbdFrame& frame) {
  KeyFrameRequest request;
  request.frame = frame.id;
  request.stamp = frame.stamp;
  current_.features->moving = MaskRuns(filter_.record()->moving);
  request.features = current_.features;
  request.landmarks = current_.landmarks;
  if (last_relative_) {
    request.reference = last_relative_->reference;
    request.camera_from_reference = last_relative_->camera_from_reference;
  }
  request.uses.reserve(uses_.size());
  for (const auto& [id, use] : uses_) request.uses.push_back({id, use.visible, use.found, use.seen_through});
  std::sort(request.uses.begin(), request.uses.end(),
            [](const auto& a, const auto& b) { return a.landmark < b.landmark; });
  uses_.clear();
  last_request_ = frame.id;
  return request;
}

}  // namespace semvslam
