#include "semvslam/apps/run_output.h"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include <bit>
#include <chrono>
#include <cstring>
#include <system_error>

#include "semvslam/data/file_io.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

constexpr const char* kResultFiles[] = {"trajectory.txt", "keyframes.txt",   "map.ply",       "stats.json",
                                        "config.yaml",    "evaluation.json", "evaluation.svg"};

}  // namespace

std::string format_ply(std::span<const Eigen::Vector3d> points) {
  static_assert(std::endian::native == std::endian::little, "PLY output is written in the machine's byte order");
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment landmarks, metres\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n",
      points.size());
  const std::size_t header = out.size();
  out.resize(header + points.size() * 3 * sizeof(float));
  char* to = out.data() + header;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3f single = p.cast<float>();
    std::memcpy(to, single.data(), 3 * sizeof(float));
    to += 3 * sizeof(float);
  }
  return out;
}

Result<RunOutput> RunOutput::create(const fs::path& folder) {
  if (const Status status = make_folder(folder); !status) return status.error();
  std::error_code code;
  for (const char* name : kResultFiles) {
    fs::remove(folder / name, code);
    if (code)
      return Error{ErrorCode::kIo, fmt::format("{}: cannot replace this earlier result ({})", (folder / name).string(),
                                               code.message())};
  }
  Result<AppendingTrajectoryWriter> live = AppendingTrajectoryWriter::create(folder / "trajectory.txt");
  if (!live) return live.error();
  Result<OutputFile> log = OutputFile::create(folder / "run.log");
  if (!log) return log.error();
  return RunOutput(folder, std::move(*live), std::move(*log));
}

void RunOutput::log(std::string_view level, std::string_view message) {
  const auto now = std::chrono::system_clock::now();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  static_cast<void>(
      log_.write(fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} {:<7} {}\n", fmt::localtime(seconds), ms, level, message)));
}

Status RunOutput::write(const std::string& name, std::string_view content) const {
  return write_file_atomically(folder_ / name, content);
}

Status RunOutput::write_results(const Trajectory& refined, const Trajectory& key_frames,
                                std::span<const Eigen::Vector3d> landmarks) {
  Status first;
  const auto keep_first = [&](Status status) {
    if (first && !status) first = std::move(status);
  };
  // Should the replacement fail, the file with the poses as they were tracked stays.
  keep_first(write_trajectory(folder_ / "trajectory.txt", refined));
  keep_first(write_trajectory(folder_ / "keyframes.txt", key_frames));
  keep_first(write("map.ply", format_ply(landmarks)));
  return first;
}

}  // namespace semvslam
