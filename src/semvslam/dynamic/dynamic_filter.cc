#include "semvslam/dynamic/dynamic_filter.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "semvslam/base/ranked.h"
#include "semvslam/base/side_task.h"
#include "semvslam/dynamic/instance_rest.h"
#include "semvslam/dynamic/mover_reach.h"
#include "semvslam/geometry/depth_image.h"
#include "semvslam/geometry/image_pool.h"
#include "semvslam/geometry/mask_growth.h"
#include "semvslam/geometry/mask_lookup.h"

namespace semvslam {
namespace {

/// Of the instance's pixels, on a raster; 0 = none is measured.
float median_depth_m(const Instance& instance, const cv::Mat& depth, float metres_per_unit) {
  constexpr int kStepPx = 6;
  const cv::Rect window = instance.window & cv::Rect(cv::Point(), depth.size());
  if (instance.mask.empty() || window != instance.window) return 0;
  std::vector<float> depths_m;
  for (int y = 0; y < window.height; y += kStepPx)
    for (int x = 0; x < window.width; x += kStepPx) {
      if (instance.mask.at<std::uint8_t>(y, x) == 0) continue;
      if (const float d = depth_at_m(depth, metres_per_unit, window.x + x, window.y + y); d > 0) depths_m.push_back(d);
    }
  return depths_m.empty() ? 0 : median(std::span(depths_m));
}

}  // namespace

struct DynamicFilter::State {
  State(const Camera& c, const DynamicOptions& o)
      : camera(c),
        options(o),
        size(c.width_px, c.height_px),
        metres_per_unit(static_cast<float>(1.0 / c.depth_units_per_m)),
        rest(o.rest_after_s) {
    if (o.needs_segmentation()) repair.emplace(c, o.restoration);
    if (o.motion) motion.emplace(c, o.motion_options);
  }

  MotionFrame motion_frame() const;
  void use_segmentation(const Segmentation* given);
  void compose_mask();
  void expect_movers();
  cv::Point expected_shift_px(const MovingRegion& region) const;
  void add_moving_things(double time_s);
  bool masks(std::size_t instance) const;
  cv::Mat watched_parts(double time_s);
  std::optional<std::vector<std::uint16_t>> instances_of_tracks() const;
  void find_moving_instances(double time_s);
  void mark_features();
  void doubt_outlines();
  void doubt_near_movers();
  void open_if_needed(std::span<const float> depths_m);
  void paint(cv::Mat& target, const Instance& instance, bool whole_box);
  cv::Mat copy(const cv::Mat& mask);
  cv::Mat core_of(const cv::Mat& mask);

  const Camera camera;
  const DynamicOptions options;
  const cv::Size size;
  const float metres_per_unit;
  std::optional<SegmentationRepair> repair;
  std::optional<MotionDetector> motion;
  InstanceRest rest;

  // Of the present frame.
  RgbdFrame frame;
  std::optional<SE3> cur_from_prev;
  Segmentation segmentation;
  std::size_t masked_instances = 0;  // the best so many of segmentation.instances mask; fewer when the filter opened
  cv::Mat excluded;                  // what is left out for its class, its outline included
  cv::Mat cores;                     // the same without the outline
  bool movers_avoided = true;        // false when the filter opened
  cv::Mat expected_movers;           // where what moved in the last frame should be now
  cv::Mat avoided;                   // cores and movers: what features are not extracted from
  MotionResult motion_result;
  double last_time_s = 0;                // of motion_result
  cv::Mat regions_mask, instances_mask;  // moving things of no class; moving instances of movable classes
  std::vector<std::uint8_t> usable;
  std::shared_ptr<DynamicRecord> record;

  struct MovableMemory {  // an instance of a movable class that was seen to move
    cv::Rect window;
    double moved_at_s = 0;
  };
  std::vector<MovableMemory> moved;
  std::vector<MovableMemory>::iterator memory_of(const Instance& instance) {
    return std::find_if(moved.begin(), moved.end(),
                        [&](const MovableMemory& m) { return is_same_place(m.window, instance.window); });
  }
  std::vector<PointVerdict> verdicts;  // scratch
  ImagePool mask_pool;
  SideTask following;  // of the point tracks into the present frame; last, so that it ends first
};

DynamicFilter::DynamicFilter(const Camera& camera, const DynamicOptions& options)
    : state_(std::make_unique<State>(camera, options)) {}
DynamicFilter::~DynamicFilter() = default;

void DynamicFilter::begin(const RgbdFrame& frame, const Segmentation* segmentation,
                          const std::optional<SE3>& cur_from_prev) {
  State& s = *state_;
  s.frame = frame;
  s.cur_from_prev = cur_from_prev;
  s.record = std::make_shared<DynamicRecord>();
  s.record->frame = frame.id;
  // Beside what else comes before judge(), the extraction of features above all: it needs none of that.
  if (s.motion) s.following.start([&s, images = s.motion_frame()] { s.motion->follow(images); });
  s.segmentation = {};
  if (s.repair) s.use_segmentation(segmentation);
  s.masked_instances = s.segmentation.instances.size();
  s.movers_avoided = true;
  s.expect_movers();
  s.compose_mask();
}

MotionFrame DynamicFilter::State::motion_frame() const {
  MotionFrame out;
  out.id = frame.id;
  out.time_s = frame.stamp.seconds();
  out.gray = frame.gray;
  out.depth = frame.depth;
  out.cur_from_prev = cur_from_prev;
  return out;
}

void DynamicFilter::State::use_segmentation(const Segmentation* given) {
  RepairInput input;
  input.frame = frame.id;
  input.stamp = frame.stamp;
  input.gray = frame.gray;
  input.depth = frame.depth;
  input.segmentation = given;
  input.cur_from_prev = cur_from_prev;
  RepairedSegmentation repaired = repair->process(input);
  segmentation = std::move(repaired.segmentation);
  record->repair = repaired.record;
  if (given != nullptr) {
    record->mask_source = given->frame == frame.id ? MaskSource::kSegmented : MaskSource::kPropagated;
    record->mask_age_frames = static_cast<int>(frame.id.value - given->frame.value);
  } else if (!segmentation.instances.empty()) {
    record->mask_source = MaskSource::kPropagated;
  }
}

/// @param target made, all zero, where it is empty.
void DynamicFilter::State::paint(cv::Mat& target, const Instance& instance, bool whole_box) {
  if (target.empty()) target = mask_pool.take_zeros(size, CV_8UC1);
  const cv::Rect all(cv::Point(), size);
  if (whole_box) {
    const cv::Rect box(cv::Point(cvFloor(instance.box.x), cvFloor(instance.box.y)),
                       cv::Point(cvCeil(instance.box.br().x), cvCeil(instance.box.br().y)));
    target(box & all).setTo(255);
    return;
  }
  const cv::Rect window = instance.window & all;
  if (window == instance.window && !window.empty()) target(window).setTo(255, instance.mask);
}

/// Of a mask that may be empty: then all zero.
cv::Mat DynamicFilter::State::copy(const cv::Mat& mask) {
  if (mask.empty()) return mask_pool.take_zeros(size, CV_8UC1);
  cv::Mat out = mask_pool.take(size, CV_8UC1);
  mask.copyTo(out);
  return out;
}

/// Of a mask that may be empty: without its outline.
cv::Mat DynamicFilter::State::core_of(const cv::Mat& mask) {
  if (mask.empty()) return {};
  cv::Mat out = mask_pool.take(size, CV_8UC1);
  without_rim(mask, options.dilate_px, out);
  return out;
}

/// Whether an instance is left out for what it is, not for what it does.
bool DynamicFilter::State::masks(std::size_t instance) const {
  const Instance& i = segmentation.instances[instance];
  return instance < masked_instances && i.role == Role::kDynamic && !rest.rests(i);
}

void DynamicFilter::State::compose_mask() {
  excluded = cv::Mat();
  const bool boxes = options.masks == "boxes";
  for (std::size_t i = 0; i < masked_instances; ++i) {
    if (!masks(i)) continue;
    paint(excluded, segmentation.instances[i], boxes);
  }
  if (!excluded.empty() && !boxes) fit_to_depth(excluded, frame.depth, metres_per_unit, options.fit);
  cores = core_of(excluded);
  if (!frame.mask.empty()) {  // its outline is the caller's word
    if (record->mask_source == MaskSource::kNone) record->mask_source = MaskSource::kGiven;
    for (cv::Mat* mask : {&cores, &excluded}) {
      if (mask->empty()) *mask = mask_pool.take_zeros(size, CV_8UC1);
      mask->setTo(255, frame.mask);
    }
  }
  if (!excluded.empty()) grow_mask(excluded, options.dilate_px);
  record->masked_share = excluded.empty() ? 0 : static_cast<double>(cv::countNonZero(excluded)) / size.area();
  avoided = cores;
  if (expected_movers.empty() || !movers_avoided) return;
  if (cores.empty()) {
    avoided = expected_movers;
    return;
  }
  avoided = mask_pool.take(size, CV_8UC1);
  cv::bitwise_or(cores, expected_movers, avoided);
}

/// Features on what motion has found would be thrown away; the static scene shall have them. Where a mover is expected
/// only its inside is taken for it, judge() decides on the rest.
void DynamicFilter::State::expect_movers() {
  expected_movers = cv::Mat();
  if (!motion) return;
  constexpr int kRimPx = 4;  // how far off the expected place may be
  const cv::Mat element = cv::getStructuringElement(cv::MORPH_RECT, {2 * kRimPx + 1, 2 * kRimPx + 1});
  const auto add_inside = [&](const cv::Rect& window, const cv::Mat& mask) {
    const cv::Rect visible = window & cv::Rect(cv::Point(), size);
    if (visible.empty() || mask.size() != window.size()) return;
    cv::Mat inside;
    cv::erode(mask, inside, element, {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
    if (expected_movers.empty()) expected_movers = mask_pool.take_zeros(size, CV_8UC1);
    expected_movers(visible).setTo(255, inside(visible - window.tl()));
  };
  for (const MovingRegion& region : motion_result.regions)
    add_inside(region.window + expected_shift_px(region), region.mask);
  for (const Instance& instance : segmentation.instances)
    if (instance.role == Role::kMovable && memory_of(instance) != moved.end())
      add_inside(instance.window, instance.mask);
}

cv::Point DynamicFilter::State::expected_shift_px(const MovingRegion& region) const {
  if (region.depth_m <= 0) return {};
  const Eigen::Vector2d from(region.window.x + region.window.width / 2.0, region.window.y + region.window.height / 2.0);
  const double elapsed_s = frame.stamp.seconds() - last_time_s;
  Eigen::Vector3d point = camera.back_project(camera.undistort(from), region.depth_m);
  if (region.state == RegionState::kMoving) point += region.velocity_m_s.cast<double>() * elapsed_s;
  if (cur_from_prev) point = *cur_from_prev * point;
  if (point.z() <= 0.05) return {};
  const Eigen::Vector2d shift = camera.distort(camera.project(point)) - from;
  return shift.norm() < size.width ? cv::Point(cvRound(shift.x()), cvRound(shift.y())) : cv::Point();
}

const cv::Mat& DynamicFilter::excluded() const { return state_->avoided; }

bool DynamicFilter::relax(int features_with_depth) {
  State& s = *state_;
  if (features_with_depth >= s.options.least_features) return false;
  if (s.movers_avoided && !s.expected_movers.empty()) {
    s.movers_avoided = false;  // what is found there is judged one by one
  } else if (s.masked_instances > 0) {
    s.masked_instances /= 2;  // instances stand best first
    s.record->fail_open = FailOpen::kSemantic;
  } else {
    return false;
  }
  s.compose_mask();
  return true;
}

const std::vector<std::uint8_t>& DynamicFilter::judge(std::span<const cv::Point2f> pixels,
                                                      std::span<const float> depths_m) {
  State& s = *state_;
  DynamicRecord& record = *s.record;
  s.usable.assign(pixels.size(), kFullyUsed);
  record.features.resize(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) record.features[i].pixel = pixels[i];
  record.moving = s.excluded;
  record.left_out = {s.cores};
  if (!s.motion) {
    s.doubt_outlines();
    return s.usable;
  }

  MotionFrame frame = s.motion_frame();
  frame.corners = pixels;
  frame.excluded = s.excluded;
  frame.watched = s.watched_parts(frame.time_s);
  s.following.wait();
  s.motion_result = s.motion->step(frame);
  s.last_time_s = frame.time_s;
  s.motion->judge(pixels, depths_m, s.verdicts);
  for (const TrackMotion& track : s.motion_result.check.tracks)
    ++record.track_reasons[static_cast<std::size_t>(track.reason)];
  record.moving_regions = static_cast<int>(s.motion_result.regions.size());
  s.add_moving_things(frame.time_s);
  s.mark_features();
  s.doubt_outlines();
  s.doubt_near_movers();
  s.open_if_needed(depths_m);
  return s.usable;
}

void DynamicFilter::State::add_moving_things(double time_s) {
  regions_mask = motion_result.mask;
  instances_mask = cv::Mat();
  find_moving_instances(time_s);
  if (regions_mask.empty() && instances_mask.empty()) return;
  // What was extracted with stays as it was; the record gets everything.
  record->moving = copy(excluded);
  for (const cv::Mat* mask : {&regions_mask, &instances_mask}) add_grown(record->moving, *mask, options.dilate_px);
  // Not of instances: each was seen as a whole before it moved, and landmarks are on it.
  regions_mask = core_of(regions_mask);
  record->left_out = {cores, regions_mask, instances_mask};
}

cv::Mat DynamicFilter::State::watched_parts(double time_s) {
  cv::Mat watched = movers_avoided ? expected_movers : cv::Mat();
  bool own = false;  // not yet: the filter's mask may only be read
  for (std::size_t i = 0; i < masked_instances; ++i) {
    if (!masks(i) || !rest.is_worth_watching(segmentation.instances[i], time_s)) continue;
    if (!own) watched = copy(watched);
    own = true;
    paint(watched, segmentation.instances[i], false);
  }
  return watched;
}

/// Per track: which instance it lies in that may move, counted from 1; 0 = none. Nothing where no instance may.
std::optional<std::vector<std::uint16_t>> DynamicFilter::State::instances_of_tracks() const {
  std::vector<std::size_t> asked;
  for (std::size_t i = segmentation.instances.size(); i-- > 0;) {  // of those that overlap the last counts
    const Instance& instance = segmentation.instances[i];
    const bool may = instance.role == Role::kMovable || (instance.role == Role::kDynamic && options.rest_after_s > 0);
    if (may && !instance.mask.empty()) asked.push_back(i);
  }
  if (asked.empty()) return std::nullopt;
  const auto covers = [&](std::size_t i, cv::Point at) {
    const Instance& instance = segmentation.instances[i];
    return instance.window.contains(at) && instance.mask.at<std::uint8_t>(at - instance.window.tl()) != 0;
  };
  std::vector<std::uint16_t> out(motion->tracks().size(), 0);
  for (std::size_t t = 0; t < out.size(); ++t) {
    const Eigen::Vector2f& pixel = motion->tracks()[t].newest().pixel;
    const cv::Point at = nearest_pixel(size, {pixel.x(), pixel.y()});
    const auto top = std::find_if(asked.begin(), asked.end(), [&](std::size_t i) { return covers(i, at); });
    if (top != asked.end()) out[t] = static_cast<std::uint16_t>(*top + 1);
  }
  return out;
}

void DynamicFilter::State::find_moving_instances(double time_s) {
  std::erase_if(moved, [&](const MovableMemory& m) { return time_s - m.moved_at_s > options.movable_hold_s; });
  const std::optional<std::vector<std::uint16_t>> instances = instances_of_tracks();
  if (!instances) return;
  const std::vector<InstanceMotion> motions =
      count_instance_motion(motion_result.check.tracks, *instances, segmentation.instances.size());
  std::vector<std::uint8_t> rested(motions.size(), 0);
  for (std::size_t i = 0; i < motions.size(); ++i) rested[i] = rest.rests(segmentation.instances[i]);
  rest.update(segmentation.instances, motions, time_s);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Instance& instance = segmentation.instances[i];
    if (rested[i] && !rest.rests(instance)) {  // she has just moved: her features were taken, and go
      paint(instances_mask, instance, false);
      ++record->moving_instances;
    }
    if (instance.role != Role::kMovable) continue;
    const auto memory = memory_of(instance);
    const bool moves =
        motions[i].moving >= options.movable_points && motions[i].moving_share() >= options.movable_share;
    if (!moves && memory == moved.end()) continue;
    if (memory == moved.end())
      moved.push_back({instance.window, time_s});
    else
      *memory = {instance.window, moves ? time_s : memory->moved_at_s};
    paint(instances_mask, instance, false);
    ++record->moving_instances;
  }
}

void DynamicFilter::State::mark_features() {
  for (std::size_t i = 0; i < record->features.size(); ++i) {
    FeatureMark& mark = record->features[i];
    const auto [verdict, sure] = verdicts[i];
    if (is_masked(instances_mask, mark.pixel))
      mark.verdict = FeatureVerdict::kMoving, mark.reason = FeatureReason::kMovingInstance;
    else if (is_masked(regions_mask, mark.pixel) ||
             (verdict == MotionVerdict::kMoving && is_masked(motion_result.mask, mark.pixel)))
      mark.verdict = FeatureVerdict::kMoving, mark.reason = FeatureReason::kMovingRegion;
    else if (verdict == MotionVerdict::kMoving)
      mark.verdict = FeatureVerdict::kMoving, mark.reason = FeatureReason::kPointMotion;
    else if (verdict == MotionVerdict::kStatic)
      mark.verdict = FeatureVerdict::kStatic, mark.reason = FeatureReason::kNone;
    if (mark.verdict != FeatureVerdict::kMoving)
      usable[i] = kFullyUsed;
    else  // what moves beside it may be another surface
      usable[i] = mark.reason == FeatureReason::kPointMotion && !sure ? kKnownLandmarkOnly : kNotUsed;
  }
}

/// A corner on the outline of something that moves may be made by it or lie behind it, and its descriptor sees both
/// sides. A known landmark that looks like it, where it should be, tells; but no landmark may come from it.
void DynamicFilter::State::doubt_outlines() {
  for (std::size_t i = 0; i < record->features.size(); ++i) {
    FeatureMark& mark = record->features[i];
    if (mark.verdict == FeatureVerdict::kMoving || !is_masked(record->moving, mark.pixel)) continue;
    mark.reason = FeatureReason::kAtOutline;
    usable[i] = kKnownLandmarkOnly;
  }
}

void DynamicFilter::State::doubt_near_movers() {
  if (options.reach_m <= 0) return;
  MoverReach reach(camera, frame.depth, options.reach_m);
  for (std::size_t i = 0; i < masked_instances; ++i) {
    const Instance& instance = segmentation.instances[i];
    if (masks(i)) reach.add(instance.window, instance.mask, median_depth_m(instance, frame.depth, metres_per_unit));
  }
  for (const MovingRegion& region : motion_result.regions) reach.add(region.window, region.mask, region.depth_m);
  reach.spread();
  for (std::size_t i = 0; i < record->features.size(); ++i) {
    FeatureMark& mark = record->features[i];
    if (mark.verdict == FeatureVerdict::kMoving || mark.reason == FeatureReason::kAtOutline) continue;
    const bool tested = mark.verdict == FeatureVerdict::kStatic;
    const bool near = reach.distance_m(mark.pixel) <= (tested ? options.rest_reach_m : options.reach_m) ||
                      (!tested && reach.is_at_edge(mark.pixel));
    if (!near) continue;
    mark.reason = FeatureReason::kNearMoving;
    usable[i] = kKnownLandmarkOnly;
  }
}

void DynamicFilter::State::open_if_needed(std::span<const float> depths_m) {
  int left = 0, dropped = 0;
  for (std::size_t i = 0; i < depths_m.size(); ++i) {
    if (depths_m[i] <= 0) continue;
    (usable[i] != kNotUsed ? left : dropped) += 1;
  }
  if (left >= options.least_features || dropped == 0) return;
  // Geometry is the first to be doubted: with so little left that agrees, it may have taken the room for the mover. But
  // a mover that gets into the map drags all later frames along: what comes back may only find landmarks that are
  // known.
  std::replace(usable.begin(), usable.end(), std::uint8_t{kNotUsed}, std::uint8_t{kKnownLandmarkOnly});
  record->moving = excluded;
  record->left_out = {cores};
  record->fail_open = FailOpen::kMotion;
}

void DynamicFilter::end(const std::optional<SE3>& camera_from_world, std::span<const std::uint8_t> tracked) {
  State& s = *state_;
  std::size_t left = 0;
  for (std::size_t i = 0; i < s.record->features.size(); ++i) {
    FeatureMark& mark = s.record->features[i];
    mark.use = static_cast<FeatureUse>(s.usable[i]);
    if (mark.use != kNotUsed && left < tracked.size()) mark.tracked = tracked[left++] != 0;
    ++s.record->verdicts[static_cast<std::size_t>(mark.verdict)];
    ++s.record->reasons[static_cast<std::size_t>(mark.reason)];
  }
  if (s.motion && camera_from_world) s.motion->set_pose(s.frame.id, *camera_from_world);
}

void DynamicFilter::use_motion() {
  if (!state_->motion) state_->motion.emplace(state_->camera, state_->options.motion_options);
}

void DynamicFilter::forget_poses() {
  state_->following.wait();
  if (state_->motion) state_->motion->forget_poses();
}

std::shared_ptr<const DynamicRecord> DynamicFilter::record() const { return state_->record; }

}  // namespace semvslam
