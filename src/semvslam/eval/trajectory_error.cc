#include "semvslam/eval/trajectory_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "semvslam/geometry/alignment.h"

namespace semvslam {
namespace {

constexpr double kDegPerRad = 57.295779513082321;

std::vector<RelativeError::Step> steps_in_frames(std::size_t count, std::size_t delta, bool overlapping) {
  std::vector<RelativeError::Step> steps;
  for (std::size_t from = 0; from + delta < count; from += overlapping ? 1 : delta)
    steps.push_back({from, from + delta});
  return steps;
}

std::vector<RelativeError::Step> steps_in_seconds(const Trajectory& estimate, const std::vector<PosePair>& pairs,
                                                  double delta_s, bool overlapping) {
  const std::int64_t delta_ns = TimeStamp::from_seconds(delta_s).ns;
  const std::int64_t tolerance_ns = delta_ns / 20;
  const auto stamp_ns = [&](std::size_t k) { return estimate[pairs[k].estimate].stamp.ns; };
  std::vector<RelativeError::Step> steps;
  std::size_t after = 0;  // the first pair not before the target
  for (std::size_t from = 0; from < pairs.size();) {
    const std::int64_t target = stamp_ns(from) + delta_ns;
    while (after < pairs.size() && stamp_ns(after) < target) ++after;
    std::size_t to = std::min(after, pairs.size() - 1);
    if (to > 0 && target - stamp_ns(to - 1) <= std::abs(stamp_ns(to) - target)) --to;
    const bool found = to > from && std::abs(stamp_ns(to) - target) <= tolerance_ns;
    if (found) steps.push_back({from, to});
    from = found && !overlapping ? to : from + 1;
  }
  return steps;
}

}  // namespace

Result<AbsoluteError> absolute_error(const Trajectory& reference, const Trajectory& estimate,
                                     const std::vector<PosePair>& pairs, bool with_scale) {
  if (pairs.size() < 3)
    return invalid_input(fmt::format("only {} poses could be paired by time; an alignment needs 3", pairs.size()));
  std::vector<Eigen::Vector3d> from, to;
  for (const PosePair& pair : pairs) {
    from.push_back(estimate[pair.estimate].world_from_camera.translation());
    to.push_back(reference[pair.reference].world_from_camera.translation());
  }
  const Result<Alignment> alignment = align_points(to, from, with_scale);
  if (!alignment) return alignment.error();
  return absolute_error(reference, estimate, pairs, alignment->a_from_b);
}

AbsoluteError absolute_error(const Trajectory& reference, const Trajectory& estimate,
                             const std::vector<PosePair>& pairs, const Sim3& reference_from_estimate) {
  AbsoluteError out;
  out.reference_from_estimate = reference_from_estimate;
  for (const PosePair& pair : pairs) {
    out.stamps.push_back(estimate[pair.estimate].stamp);
    out.reference.push_back(reference[pair.reference].world_from_camera.translation());
    out.estimate.push_back(reference_from_estimate * estimate[pair.estimate].world_from_camera.translation());
    out.errors_m.push_back((out.reference.back() - out.estimate.back()).norm());
  }
  out.statistics_m = error_statistics(out.errors_m);
  return out;
}

Result<Delta> Delta::parse(std::string_view text) {
  const Error bad = invalid_input(
      fmt::format("a delta is a number with s (seconds) or f (frames), like 1s or 30f; got '{}'", text.substr(0, 40)));
  if (text.size() < 2 || (text.back() != 's' && text.back() != 'f')) return bad;
  Delta delta;
  delta.unit = text.back() == 's' ? Unit::kSeconds : Unit::kFrames;
  const char* end = text.data() + text.size() - 1;
  const auto [stop, code] = std::from_chars(text.data(), end, delta.amount);
  if (code != std::errc() || stop != end || !(delta.amount >= 1e-3 && delta.amount <= 1e6)) return bad;
  if (delta.unit == Unit::kFrames && delta.amount != std::floor(delta.amount)) return bad;
  return delta;
}

std::string Delta::text() const { return fmt::format("{}{}", amount, unit == Unit::kSeconds ? "s" : "f"); }

Result<RelativeError> relative_error(const Trajectory& reference, const Trajectory& estimate,
                                     const std::vector<PosePair>& pairs, const RelativeErrorOptions& options) {
  RelativeError out;
  out.steps = options.delta.unit == Delta::Unit::kFrames
                  ? steps_in_frames(pairs.size(), static_cast<std::size_t>(options.delta.amount), options.overlapping)
                  : steps_in_seconds(estimate, pairs, options.delta.amount, options.overlapping);
  if (out.steps.empty())
    return invalid_input(fmt::format("no two of the {} paired poses are {} apart; choose a smaller delta", pairs.size(),
                                     options.delta.text()));
  const auto true_pose = [&](std::size_t k) -> const SE3& { return reference[pairs[k].reference].world_from_camera; };
  const auto estimated_pose = [&](std::size_t k) {
    const SE3& pose = estimate[pairs[k].estimate].world_from_camera;
    return SE3(pose.rotation(), options.scale * pose.translation());
  };
  for (const auto& [from, to] : out.steps) {
    const SE3 true_step = true_pose(from).inverse() * true_pose(to);
    const SE3 estimated_step = estimated_pose(from).inverse() * estimated_pose(to);
    const SE3 error = true_step.inverse() * estimated_step;
    out.translation_errors_m.push_back(error.translation().norm());
    out.rotation_errors_deg.push_back(error.rotation_angle_rad() * kDegPerRad);
  }
  out.translation_m = error_statistics(out.translation_errors_m);
  out.rotation_deg = error_statistics(out.rotation_errors_deg);
  return out;
}

}  // namespace semvslam
