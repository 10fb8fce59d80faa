#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/frame.h"
#include "semvslam/data/trajectory_io.h"

namespace semvslam {

/// Points as a binary little-endian PLY file (float x y z).
std::string format_ply(std::span<const Eigen::Vector3d> points);

/// The folder that a run writes to: trajectory.txt, keyframes.txt, map.ply, stats.json, config.yaml, run.log. While the
/// run goes on, trajectory.txt grows by the poses as they were tracked and run.log by lines, both handed to the
/// operating system within a second; at the end the trajectory is replaced in one step by the refined one. One thread.
class RunOutput {
 public:
  /// Makes the folder and starts trajectory.txt and run.log; results of an earlier run in it are removed first, so that
  /// the folder never mixes two runs. Errors: not a folder, not writable, disk full.
  static Result<RunOutput> create(const std::filesystem::path& folder);

  /// A pose the moment it was tracked. An Error (disk full) may pass: the pose is kept and written with a later one.
  Status add_pose(const StampedPose& pose) { return live_.append(pose); }
  /// A line in run.log with the time of day. Failures to write the log are not reported: the results' failures are.
  void log(std::string_view level, std::string_view message);

  /// Replaces a file of the folder in one step.
  Status write(const std::string& name, std::string_view content) const;
  /// The three results at the end. All are tried; the first Error is returned.
  Status write_results(const Trajectory& refined, const Trajectory& key_frames,
                       std::span<const Eigen::Vector3d> landmarks);
  const std::filesystem::path& folder() const { return folder_; }

 private:
  RunOutput(std::filesystem::path folder, AppendingTrajectoryWriter live, OutputFile log)
      : folder_(std::move(folder)), live_(std::move(live)), log_(std::move(log)) {}

  std::filesystem::path folder_;
  AppendingTrajectoryWriter live_;
  OutputFile log_;
};

}  // namespace semvslam
