#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/web/viewed_run.h"

namespace semvslam {

/// How much of a live run a reader has: the page asks for what came later.
struct LiveCursor {
  std::uint64_t generation = 0;  // of the run's files; poses of another one do not continue these
  std::size_t poses = 0;         // how many lines of trajectory.txt
  bool operator==(const LiveCursor&) const = default;
};

/// Runs and how they are shown.
struct Scene {
  std::vector<ViewedRun> runs;  // at least one, see bring_together()
  bool in_truth_world = false;
  std::optional<LiveCursor> live;  // of the only run
};

inline constexpr std::size_t kMostShownPoses = 20'000;  // of all trajectories together; more are thinned evenly

/// The direction in the world that is up for cameras that are held level, whatever they look up or down at: a unit
/// vector as square as can be to their x axes, not far from what is up in their pictures; -y of the world without any
/// pose.
Eigen::Vector3d up_of(const std::vector<ViewedRun>& runs);

/// Indices of at most `most` of n, evenly spread, the last among them.
std::vector<std::size_t> evenly(std::size_t n, std::size_t most);

/// The scene as the page's script reads it: JSON with typed arrays in base64, seconds from the start of the runs.
/// Safe inside a script element: no '<'.
std::string format_scene(const Scene& scene);

/// A pose as the page's script reads it: seconds since `start`, x y z (m), quaternion x y z w.
std::string format_live_pose(const StampedPose& pose, TimeStamp start);

}  // namespace semvslam
