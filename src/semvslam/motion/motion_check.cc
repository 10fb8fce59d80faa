#include "semvslam/motion/motion_check.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "semvslam/base/ranked.h"
#include "semvslam/geometry/epipolar.h"

namespace semvslam {
namespace {

constexpr std::size_t kPosesHeld = FlowTrack::kCapacity + 2;
constexpr double kNearestM = 0.05;
constexpr double kSuspectWeight = 0.15;  // of a vote from where something moved: not 0, it may have been an error
constexpr double kNearestSceneM = 0.3;   // nothing of the scene is nearer: end of a point's epipolar line

double depth_sigma_m(const MotionCheckOptions& options, const TrackSample& sample) {
  const double z = sample.depth_m, noise = options.depth_sigma_per_m2 * z * z, bias = options.depth_bias_share * z;
  const double edge = 0.5 * sample.depth_spread_m;
  return std::sqrt(noise * noise + bias * bias + edge * edge);
}

// From `p` to the nearest place of the segment a-b.
Eigen::Vector2d offset_from_segment_px(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = b - a;
  const double length = d.squaredNorm(), t = length > 0 ? std::clamp((p - a).dot(d) / length, 0.0, 1.0) : 0;
  return p - (a + t * d);
}

}  // namespace

std::string_view to_string(MotionVerdict verdict) {
  switch (verdict) {
    case MotionVerdict::kUnknown:
      return "unknown";
    case MotionVerdict::kStatic:
      return "static";
    case MotionVerdict::kMoving:
      return "moving";
  }
  return "";
}

std::string_view to_string(MotionReason reason) {
  switch (reason) {
    case MotionReason::kNone:
      return "none";
    case MotionReason::kNew:
      return "new";
    case MotionReason::kNoEvidence:
      return "no_evidence";
    case MotionReason::kNoPose:
      return "no_pose";
    case MotionReason::kEpipolar:
      return "epipolar";
    case MotionReason::kReprojection:
      return "reprojection";
    case MotionReason::kNearer:
      return "nearer";
    case MotionReason::kFarther:
      return "farther";
    case MotionReason::kMemory:
      return "memory";
  }
  return "";
}

void MotionCheckOptions::add_to(ConfigSchema& schema) {
  schema.add("motion.epipolar_px", &epipolar_px, {0.1, 100.0},
             "distance from the epipolar line above which a point moves, px");
  schema.add("motion.pixel_sigma_px", &pixel_sigma_px, {0.05, 10.0}, "standard deviation of a tracked point, px");
  schema.add("motion.slip_share", &slip_share, {0.0, 1.0},
             "standard deviation by which a track slips, share of the way it went");
  schema.add("motion.edge_slip_share", &edge_slip_share, {0.0, 1.0}, "the same where two depths meet");
  schema.add("motion.depth_sigma_per_m2", &depth_sigma_per_m2, {0.0, 0.1},
             "depth noise: standard deviation / depth^2, 1/m");
  schema.add("motion.depth_bias_share", &depth_bias_share, {0.0, 0.2},
             "depth error that neighbours share, share of the depth");
  schema.add("motion.moving_sigmas", &moving_sigmas, {1.0, 100.0},
             "residual above which a point moves, standard deviations");
  schema.add("motion.static_sigmas", &static_sigmas, {0.5, 100.0},
             "residual below which it is at rest, standard deviations");
  schema.add("motion.min_speed_m_s", &min_speed_m_s, {0.0, 10.0}, "slower points are at rest, m/s");
  schema.add("motion.max_baseline_frames", &max_baseline_frames, {1, FlowTrack::kCapacity - 1},
             "frames over which motion is measured at most");
  schema.add("motion.memory_frames", &memory_frames, {0, 100},
             "frames for which a moving point stays so without evidence");
}

MotionCheck::MotionCheck(const Camera& camera, const MotionCheckOptions& options,
                         const CameraMotionOptions& camera_options, const FundamentalOptions& fundamental_options)
    : camera_(camera), options_(options), camera_options_(camera_options), fundamental_options_(fundamental_options) {}

const MotionCheck::Pose* MotionCheck::pose_of(FrameId frame) const {
  for (const Pose& pose : poses_)
    if (pose.frame == frame) return &pose;
  return nullptr;
}

void MotionCheck::set_pose(FrameId frame, const SE3& camera_from_world) {
  const Pose* known = pose_of(frame);
  if (!known || !camera_from_world.is_finite()) return;
  // Poses that were only chained here hang on this one: they move with it.
  const SE3 old_world_from_new = known->camera_from_world.inverse() * camera_from_world;
  for (Pose& pose : poses_) {
    if (pose.frame == frame) {
      pose.camera_from_world = camera_from_world;
      pose.given = true;
    } else if (!pose.given) {
      pose.camera_from_world = pose.camera_from_world * old_world_from_new;
    }
  }
}

void MotionCheck::forget_poses() { poses_.clear(); }

CameraMotion MotionCheck::find_camera_motion(const MotionFrame& frame, std::span<const FlowTrack> tracks,
                                             const cv::Mat& suspect) {
  CameraMotion motion;
  if (poses_.empty()) return motion;
  const Pose& previous = poses_.back();
  if (frame.camera_from_world && previous.given) {
    motion.source = CameraMotionSource::kGiven;
    motion.cur_from_prev = *frame.camera_from_world * previous.camera_from_world.inverse();
    return motion;
  }
  std::vector<PointPair> pairs;
  pairs.reserve(tracks.size());
  for (const FlowTrack& track : tracks) {
    if (track.size() < 2 || track.sample(1).frame != previous.frame) continue;
    const TrackSample &now = track.sample(0), &before = track.sample(1);
    if (now.excluded || before.excluded) continue;
    const auto memory = moved_.find(track.id());
    if (memory != moved_.end()) continue;
    // Depth at an edge belongs to one side or the other: such a pair is not asked, unless hardly anything else is
    // there.
    double weight = before.depth_spread_m > 0.05 * before.depth_m ? 0.2 : 1;
    if (!suspect.empty() &&
        suspect.at<std::uint8_t>(static_cast<int>(before.pixel.y()), static_cast<int>(before.pixel.x())))
      weight *= kSuspectWeight;
    pairs.push_back({before.ideal.cast<double>(), now.ideal.cast<double>(), before.depth_m, now.depth_m, weight});
  }
  return estimate_camera_motion(pairs, camera_, frame.cur_from_prev, camera_options_);
}

void MotionCheck::add_pose(const MotionFrame& frame, const CameraMotion& motion) {
  const bool linked = !poses_.empty() && motion.source != CameraMotionSource::kNone;
  const SE3 chained = linked ? motion.cur_from_prev * poses_.back().camera_from_world : SE3();
  if (!linked) poses_.clear();  // nothing relates this frame to those before
  poses_.push_back({frame.id, chained, false});
  if (motion.source == CameraMotionSource::kPredicted) poses_.back().doubtful = true;
  if (frame.camera_from_world) set_pose(frame.id, *frame.camera_from_world);
  if (poses_.size() > kPosesHeld) poses_.erase(poses_.begin());
}

FundamentalEstimate MotionCheck::find_fundamental(std::span<const FlowTrack> tracks, int age) const {
  std::vector<Eigen::Vector2d> from, to;
  for (const FlowTrack& track : tracks) {
    if (track.size() <= age || track.sample(0).excluded || track.sample(age).excluded || moved_.contains(track.id()))
      continue;
    from.push_back(track.sample(age).ideal.cast<double>());
    to.push_back(track.sample(0).ideal.cast<double>());
  }
  return estimate_fundamental(from, to, fundamental_options_);
}

MotionCheckResult MotionCheck::step(const MotionFrame& frame, std::span<const FlowTrack> tracks,
                                    const cv::Mat& suspect) {
  MotionCheckResult result;
  result.camera = find_camera_motion(frame, tracks, suspect);
  add_pose(frame, result.camera);
  // As long a way as most tracks have: parallax grows with it.
  std::vector<int> ages;
  for (const FlowTrack& track : tracks)
    if (track.size() > 1) ages.push_back(track.size() - 1);
  if (!ages.empty()) {
    result.fundamental_age = std::clamp(quantile(std::span(ages), 0.25), 1, options_.max_baseline_frames);
    result.fundamental = find_fundamental(tracks, result.fundamental_age);
  }
  result.tracks.reserve(tracks.size());
  for (const FlowTrack& track : tracks) result.tracks.push_back(measure(track, result));
  result.noise_scale = noise_scale(result.tracks, tracks);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    TrackMotion& motion = result.tracks[i];
    decide(tracks[i], result, motion);
    result.moving += motion.verdict == MotionVerdict::kMoving;
    result.at_rest += motion.verdict == MotionVerdict::kStatic;
    result.unknown += motion.verdict == MotionVerdict::kUnknown;
  }
  remember(result.tracks);
  return result;
}

void MotionCheck::remember(std::span<const TrackMotion> motions) {
  std::unordered_map<PointTrackId, Memory> moved;
  for (const TrackMotion& motion : motions)
    if (motion.verdict == MotionVerdict::kMoving) {
      const auto before = moved_.find(motion.id);
      const int since =
          motion.reason != MotionReason::kMemory || before == moved_.end() ? 0 : before->second.frames_since + 1;
      moved[motion.id] = {since, motion.moving_frames};
    }
  moved_ = std::move(moved);
}

// A point is found the better the more the grey values around it change, in each direction by itself: the covariance of
// the flow is proportional to the inverse of the gradient's second moments (aperture problem). What a track slips grows
// with its way.
Eigen::Matrix2d MotionCheck::pixel_covariance(const TrackSample& then, const TrackSample& now) const {
  constexpr double kStrongTexture = 20;  // squared grey levels per px: where the texture starts to matter
  constexpr double kLeastTexture = 0.5;
  const TrackSample& weak = now.texture.x() + now.texture.z() < then.texture.x() + then.texture.z() ? now : then;
  Eigen::Matrix2d moments;
  moments << weak.texture.x() + kLeastTexture, weak.texture.y(), weak.texture.y(), weak.texture.z() + kLeastTexture;
  const double edge =
      now.depth_m > 0 && then.depth_m > 0
          ? std::min(1.0, 10.0 * std::max(now.depth_spread_m / now.depth_m, then.depth_spread_m / then.depth_m))
          : 1;
  const double slip =
      (options_.slip_share + edge * (options_.edge_slip_share - options_.slip_share)) * (now.ideal - then.ideal).norm();
  const double variance = 2 * options_.pixel_sigma_px * options_.pixel_sigma_px + slip * slip;
  return variance * (Eigen::Matrix2d::Identity() + kStrongTexture * moments.inverse());
}

TrackMotion MotionCheck::measure(const FlowTrack& track, const MotionCheckResult& result) const {
  TrackMotion motion;
  motion.id = track.id();
  if (track.size() < 2) return motion;
  const TrackSample& now = track.newest();
  const Eigen::Vector2d pixel = now.ideal.cast<double>();
  if (result.fundamental.usable() && track.size() > result.fundamental_age)
    motion.epipolar_px = static_cast<float>(epipolar_distance_px(
        result.fundamental.matrix, track.sample(result.fundamental_age).ideal.cast<double>(), pixel));
  const int oldest = std::min(track.size() - 1, options_.max_baseline_frames);
  const Pose& current = poses_.back();
  // The oldest sample whose depth is not torn by an edge; failing that, the oldest with depth; failing that, the
  // oldest.
  int chosen = 0, with_depth = 0, with_pose = 0;
  for (int age = oldest; age >= 1 && !chosen; --age) {
    const TrackSample& sample = track.sample(age);
    if (!pose_of(sample.frame)) continue;
    if (!with_pose) with_pose = age;
    if (!(sample.depth_m > 0)) continue;
    if (!with_depth) with_depth = age;
    if (sample.depth_spread_m < 0.05f * sample.depth_m) chosen = age;
  }
  if (2 * chosen < with_depth) chosen = with_depth;
  if (!with_pose) {
    motion.reason = MotionReason::kNoPose;
    return motion;
  }
  motion.baseline_frames = chosen ? chosen : with_pose;
  const TrackSample& then = track.sample(motion.baseline_frames);
  const SE3 now_from_then = current.camera_from_world * pose_of(then.frame)->camera_from_world.inverse();
  const double elapsed_s = now.time_s - then.time_s;
  if (!chosen) {
    measure_on_segment(then, now, now_from_then, motion);
    return motion;
  }
  const Eigen::Vector3d ray = camera_.back_project(then.ideal.cast<double>(), 1);
  const Eigen::Vector3d predicted = now_from_then * (ray * then.depth_m);
  if (predicted.z() < kNearestM) return motion;
  const Eigen::Vector2d residual = pixel - camera_.project(predicted);
  // Uncertainty of the prediction: the depth's along the direction in which depth shifts the point, the pixels' about.
  const Eigen::Vector3d along = now_from_then.rotation() * ray;
  const double iz = 1 / predicted.z(), sigma_m = depth_sigma_m(options_, then);
  const Eigen::Vector2d shift(camera_.fx_px * iz * (along.x() - predicted.x() * iz * along.z()) * sigma_m,
                              camera_.fy_px * iz * (along.y() - predicted.y() * iz * along.z()) * sigma_m);
  const Eigen::Matrix2d covariance = shift * shift.transpose() + pixel_covariance(then, now);
  motion.reprojection_px = static_cast<float>(residual.norm());
  motion.reprojection_sigmas = static_cast<float>(std::sqrt(residual.dot(covariance.inverse() * residual)));
  Eigen::Vector3d displacement(residual.x() / camera_.fx_px * predicted.z(),
                               residual.y() / camera_.fy_px * predicted.z(), 0);
  if (now.depth_m > 0) {
    const double sigma_now = depth_sigma_m(options_, now), sigma_then = std::abs(along.z()) * sigma_m;
    motion.depth_residual_m = static_cast<float>(now.depth_m - predicted.z());
    motion.depth_sigmas = static_cast<float>(motion.depth_residual_m / std::hypot(sigma_now, sigma_then));
    if (std::abs(motion.depth_sigmas) > options_.static_sigmas)
      displacement = camera_.back_project(pixel, now.depth_m) - predicted;
  }
  if (elapsed_s > 0) motion.velocity_m_s = (displacement / elapsed_s).cast<float>();
  motion.reason = MotionReason::kNone;
  return motion;
}

void MotionCheck::measure_on_segment(const TrackSample& then, const TrackSample& now, const SE3& now_from_then,
                                     TrackMotion& motion) const {
  motion.reason = MotionReason::kNoEvidence;
  const Eigen::Vector3d ray = camera_.back_project(then.ideal.cast<double>(), 1);
  const Eigen::Vector3d far = now_from_then.rotation() * ray, near = now_from_then * (ray * kNearestSceneM);
  if (far.z() < kNearestM || near.z() < kNearestM) return;
  const Eigen::Vector2d offset =
      offset_from_segment_px(now.ideal.cast<double>(), camera_.project(near), camera_.project(far));
  motion.reprojection_px = static_cast<float>(offset.norm());
  motion.reprojection_sigmas =
      static_cast<float>(std::sqrt(offset.dot(pixel_covariance(then, now).inverse() * offset)));
}

double MotionCheck::noise_scale(std::span<const TrackMotion> motions, std::span<const FlowTrack> tracks) const {
  std::vector<float> squared;
  for (std::size_t i = 0; i < motions.size(); ++i)
    if (motions[i].reason == MotionReason::kNone && !tracks[i].newest().excluded && !moved_.contains(motions[i].id))
      squared.push_back(motions[i].reprojection_sigmas * motions[i].reprojection_sigmas);
  if (squared.size() < 10) return 1;
  // The quantile below which 40 % lie is that of points at rest even when half of the points move; chi^2 with two
  // degrees of freedom has it at -2 log(1 - 0.4).
  constexpr double kShare = 0.4;
  const double expected = -2 * std::log(1 - kShare);
  return std::clamp(std::sqrt(quantile(std::span(squared), kShare) / expected), 1.0, kMaxNoiseScale);
}

void MotionCheck::decide(const FlowTrack& track, const MotionCheckResult& result, TrackMotion& motion) const {
  if (track.size() < 2) return;
  const double scale = result.noise_scale;
  const bool doubtful = poses_.back().doubtful || motion.reason == MotionReason::kNoPose;
  const bool measured = motion.reason == MotionReason::kNone && !doubtful;
  const double moving = options_.moving_sigmas * scale, at_rest = options_.static_sigmas * scale;
  const double speed = motion.velocity_m_s.norm();
  const bool off_line = motion.epipolar_px > options_.epipolar_px * scale;
  const bool by_segment = motion.reason == MotionReason::kNoEvidence && !doubtful && motion.reprojection_px >= 0;
  const bool fits = (measured || by_segment) && motion.reprojection_sigmas < at_rest &&
                    std::abs(motion.depth_sigmas) < options_.static_sigmas;
  const auto set = [&](MotionVerdict verdict, MotionReason reason) {
    if (verdict == MotionVerdict::kMoving) {
      const auto before = moved_.find(motion.id);
      motion.moving_frames = before == moved_.end() ? 1 : before->second.in_a_row + 1;
    }
    motion.verdict = verdict;
    motion.reason = reason;
  };
  if (measured && speed >= options_.min_speed_m_s && motion.reprojection_sigmas > moving)
    set(MotionVerdict::kMoving, off_line ? MotionReason::kEpipolar : MotionReason::kReprojection);
  else if (measured && speed >= options_.min_speed_m_s && std::abs(motion.depth_sigmas) > options_.moving_sigmas)
    set(MotionVerdict::kMoving, motion.depth_residual_m < 0 ? MotionReason::kNearer : MotionReason::kFarther);
  else if (by_segment && motion.reprojection_sigmas > moving)
    set(MotionVerdict::kMoving, off_line ? MotionReason::kEpipolar : MotionReason::kReprojection);
  else if (off_line && !measured && !by_segment)
    set(MotionVerdict::kMoving, MotionReason::kEpipolar);
  else if (const auto memory = moved_.find(motion.id);
           memory != moved_.end() && memory->second.frames_since < options_.memory_frames && !fits)
    set(MotionVerdict::kMoving, MotionReason::kMemory);
  else if ((fits && measured) || (measured && speed < options_.min_speed_m_s))
    set(MotionVerdict::kStatic, MotionReason::kNone);
  else if (doubtful)
    set(MotionVerdict::kUnknown, MotionReason::kNoPose);
  else
    set(MotionVerdict::kUnknown, MotionReason::kNoEvidence);
}

}  // namespace semvslam
