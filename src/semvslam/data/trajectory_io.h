#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "semvslam/base/result.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/frame.h"

namespace semvslam {

/// A trajectory file as it was understood.
struct ParsedTrajectory {
  Trajectory poses;              // strictly increasing stamps
  std::size_t out_of_order = 0;  // lines older than the line before them (sorted)
  std::size_t duplicates = 0;    // lines with a stamp that an earlier line had (dropped)
};

/// Parses TUM text: `t tx ty tz qx qy qz qw` per line, metres and world_from_camera. Comments, blank lines, CRLF are
/// fine; quaternions are normalised. Errors name file and line: not 8 numbers, a NaN or infinite value, a quaternion of
/// zero.
/// @param name of the file, for messages.
Result<ParsedTrajectory> parse_trajectory(std::string_view text, const std::string& name);

/// Reads a TUM trajectory file. Errors: as parse_trajectory; missing; no pose in it.
Result<Trajectory> read_trajectory(const std::filesystem::path& path);

/// One line with its newline: nine decimals of the exact stamp, nine of position (m) and quaternion (qw not negative).
std::string format_pose_line(const StampedPose& pose);

/// Replaces `path` in one step (see write_file_atomically).
Status write_trajectory(const std::filesystem::path& path, const Trajectory& trajectory);

/// Writes a trajectory while it grows: each line is handed to the operating system as it comes (some microseconds), so
/// that `kill -9` loses nothing appended. The file never ends inside a line, also when the disk is full. Not
/// thread-safe.
class AppendingTrajectoryWriter {
 public:
  static Result<AppendingTrajectoryWriter> create(const std::filesystem::path& path);

  /// After an Error (disk full) the line is kept and tried again with the next append.
  Status append(const StampedPose& pose);
  /// Lines that could not be written so far.
  bool has_pending() const { return !pending_.empty(); }

 private:
  explicit AppendingTrajectoryWriter(OutputFile file) : file_(std::move(file)) {}
  Status write_pending();
  OutputFile file_;
  std::string pending_;
};

}  // namespace semvslam
