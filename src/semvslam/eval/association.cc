#include "semvslam/eval/association.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace semvslam {
namespace {

// Seconds as a double, as rounded as if the decimal text had been read into one. Two poses are often equally near
// (stamps in microseconds); evo then decides by the rounding of its doubles, and equal results need equal pairs.
double rounded_seconds(TimeStamp stamp) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return static_cast<double>(stamp.ns / kNsPerSecond) + static_cast<double>(stamp.ns % kNsPerSecond) / 1e9;
}

}  // namespace

std::size_t nearest_pose(const Trajectory& trajectory, TimeStamp stamp) {
  const auto after = std::upper_bound(trajectory.begin(), trajectory.end(), stamp,
                                      [](TimeStamp t, const StampedPose& pose) { return t < pose.stamp; });
  const auto index = static_cast<std::size_t>(after - trajectory.begin());
  if (index == 0) return 0;
  if (index == trajectory.size()) return index - 1;
  const double t = rounded_seconds(stamp);
  return rounded_seconds(after->stamp) - t < t - rounded_seconds(trajectory[index - 1].stamp) ? index : index - 1;
}

double gap_s(TimeStamp a, TimeStamp b) { return std::abs(rounded_seconds(a) - rounded_seconds(b)); }

std::vector<PosePair> pair_by_time(const Trajectory& reference, const Trajectory& estimate, double max_gap_s) {
  const bool reference_is_shorter = reference.size() < estimate.size();
  const Trajectory& shorter = reference_is_shorter ? reference : estimate;
  const Trajectory& longer = reference_is_shorter ? estimate : reference;
  std::vector<PosePair> pairs;
  if (longer.empty()) return pairs;
  for (std::size_t i = 0; i < shorter.size(); ++i) {
    const std::size_t k = nearest_pose(longer, shorter[i].stamp);
    if (gap_s(longer[k].stamp, shorter[i].stamp) > max_gap_s) continue;
    pairs.push_back(reference_is_shorter ? PosePair{i, k} : PosePair{k, i});
  }
  return pairs;
}

double share_tracked(std::span<const TimeStamp> moments, const Trajectory& estimate, double max_gap_s) {
  if (moments.empty() || estimate.empty()) return 0;
  const auto tracked = std::count_if(moments.begin(), moments.end(), [&](TimeStamp t) {
    return gap_s(estimate[nearest_pose(estimate, t)].stamp, t) <= max_gap_s;
  });
  return static_cast<double>(tracked) / static_cast<double>(moments.size());
}

std::vector<TimeStamp> stamps_of(const Trajectory& trajectory) {
  std::vector<TimeStamp> out;
  out.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory) out.push_back(pose.stamp);
  return out;
}

}  // namespace semvslam
