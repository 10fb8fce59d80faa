#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/base/sub_map_id.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/frame.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/pipeline/slam.h"

namespace semvslam {

/// Points as a binary little-endian PLY file (float x y z).
std::string format_ply(std::span<const Eigen::Vector3d> points);

/// What a run has of one sub-map, in its world, at the end.
struct SubMapResults {
  Trajectory trajectory, key_frames;
  std::vector<KeyFrameMask> key_frame_masks;
  std::vector<Eigen::Vector3d> landmarks;

  static SubMapResults of(const Slam& slam, SubMapId sub_map);
};

/// Where things of a sub-map go that is not joined with the main one: trajectory.2.txt beside trajectory.txt.
std::filesystem::path numbered(const std::filesystem::path& path, SubMapId sub_map);

/// The folder that a run writes to: trajectory.txt, keyframes.txt, map.ply, stats.json, config.yaml, run.log. While the
/// run goes on, trajectory.txt grows by the poses as they were tracked and run.log by lines, both handed to the
/// operating system within a second; the others are replaced in one step whenever they are written, and so is the
/// trajectory at the end, by the refined one. No file ever holds poses of two worlds: those in another sub-map than the
/// first go to trajectory.2.txt and so on as they are tracked, and at the end those in another than the main one. One
/// thread.
class RunOutput {
 public:
  /// Makes the folder and starts trajectory.txt and run.log; results of an earlier run in it are removed first, so that
  /// the folder never mixes two runs. Errors: not a folder, not writable, disk full.
  static Result<RunOutput> create(const std::filesystem::path& folder);

  /// A pose the moment it was tracked. An Error (disk full) may pass: the pose is kept and written with a later one,
  /// unless the sub-map's file could not be made; that is tried again.
  Status add_pose(const StampedPose& pose, SubMapId sub_map = SubMapId(0));
  /// A line in run.log with the time of day. Failures to write the log are not reported: the results' failures are.
  void log(std::string_view level, std::string_view message);

  /// Replaces a file of the folder in one step.
  Status write(const std::string& name, std::string_view content) const;
  /// The map of a sub-map as far as it is, for those who look on and for the case that the run is killed. Of the first
  /// one alone: others may become parts of it.
  Status write_map(const Trajectory& key_frames, std::span<const Eigen::Vector3d> landmarks) const;
  /// The three results at the end, of the main sub-map and of those apart from it. All are tried; the first Error is
  /// returned.
  Status write_results(const SubMapResults& main, const std::map<SubMapId, SubMapResults>& apart);
  const std::filesystem::path& folder() const { return folder_; }

 private:
  RunOutput(std::filesystem::path folder, AppendingTrajectoryWriter live, OutputFile log)
      : folder_(std::move(folder)), log_(std::move(log)) {
    live_.emplace(SubMapId(0), std::move(live));
  }

  std::filesystem::path folder_;
  std::map<SubMapId, AppendingTrajectoryWriter> live_;
  OutputFile log_;
};

}  // namespace semvslam
