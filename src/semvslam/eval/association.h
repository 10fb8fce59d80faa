#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "semvslam/data/frame.h"

namespace semvslam {

/// Two poses of one moment, as indices into their trajectories.
struct PosePair {
  std::size_t reference = 0, estimate = 0;
};

/// Pairs the poses of two trajectories by time: each pose of the shorter one (the estimate where both are equally long)
/// with the nearest of the longer one (the earlier of two equally near), when at most `max_gap_s` away. A pose of the
/// longer one may serve twice. This is what `evo` does with `--t_max_diff`. Both must be sorted by stamp. In order of
/// time.
std::vector<PosePair> pair_by_time(const Trajectory& reference, const Trajectory& estimate, double max_gap_s);

/// Share in [0, 1] of `moments` (sorted) that have a pose of `estimate` at most `max_gap_s` away; 0 without moments.
double share_tracked(std::span<const TimeStamp> moments, const Trajectory& estimate, double max_gap_s);

/// The stamps of a trajectory.
std::vector<TimeStamp> stamps_of(const Trajectory& trajectory);

/// The time between two stamps, not negative, from stamps rounded to doubles.
double gap_s(TimeStamp a, TimeStamp b);

/// Index of the pose nearest in time, the earlier of two equally near. `trajectory` must be sorted and not empty.
std::size_t nearest_pose(const Trajectory& trajectory, TimeStamp stamp);

}  // namespace semvslam
