#include "semvslam/apps/run_output.h"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <system_error>

#include "semvslam/data/file_io.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

/// The last one is written only where it is asked for, but `view` shows it as this run's wherever it is.
constexpr const char* kResultFiles[] = {"trajectory.txt", "keyframes.txt",   "map.ply",        "stats.json",
                                        "config.yaml",    "evaluation.json", "evaluation.svg", "dense.ply"};

/// The name without the number that numbered() puts in; as it is where there is none.
std::string without_number(const fs::path& name) {
  const std::string number = name.stem().extension().string();
  const bool is_numbered = number.size() > 1 && number.find_first_not_of("0123456789", 1) == std::string::npos;
  return is_numbered ? name.stem().stem().string() + name.extension().string() : name.string();
}

/// Results of an earlier run, numbered ones too.
Status remove_results(const fs::path& folder) {
  std::error_code code;
  std::vector<fs::path> earlier;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code))
    if (std::ranges::count(kResultFiles, without_number(it->path().filename()))) earlier.push_back(it->path());
  for (const fs::path& file : earlier) {
    fs::remove(file, code);
    if (code)
      return Error{ErrorCode::kIo,
                   fmt::format("{}: cannot replace this earlier result ({})", file.string(), code.message())};
  }
  return Status::success();
}

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

SubMapResults SubMapResults::of(const Slam& slam, SubMapId sub_map) {
  return {slam.trajectory(sub_map), slam.key_frame_trajectory(sub_map), slam.key_frame_masks(sub_map),
          slam.landmark_positions(sub_map)};
}

fs::path numbered(const fs::path& path, SubMapId sub_map) {
  fs::path out = path;
  return out.replace_extension(fmt::format("{}{}", number_of(sub_map), path.extension().string()));
}

Result<RunOutput> RunOutput::create(const fs::path& folder) {
  if (const Status status = make_folder(folder); !status) return status.error();
  if (const Status status = remove_results(folder); !status) return status.error();
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

Status RunOutput::add_pose(const StampedPose& pose, SubMapId sub_map) {
  auto live = live_.find(sub_map);
  if (live == live_.end()) {
    Result<AppendingTrajectoryWriter> begun =
        AppendingTrajectoryWriter::create(numbered(folder_ / "trajectory.txt", sub_map));
    if (!begun) return begun.error();
    live = live_.emplace(sub_map, std::move(*begun)).first;
  }
  return live->second.append(pose);
}

Status RunOutput::write(const std::string& name, std::string_view content) const {
  return write_file_atomically(folder_ / name, content);
}

Status RunOutput::write_map(const Trajectory& key_frames, std::span<const Eigen::Vector3d> landmarks) const {
  if (Status status = write_trajectory(folder_ / "keyframes.txt", key_frames); !status) return status;
  return write("map.ply", format_ply(landmarks));
}

Status RunOutput::write_results(const SubMapResults& main, const std::map<SubMapId, SubMapResults>& apart) {
  Status first;
  const auto write_all = [&](const SubMapResults& results, const auto& name) {
    // Should the replacement fail, the file with the poses as they were tracked stays.
    for (Status status : {write_trajectory(folder_ / name("trajectory.txt"), results.trajectory),
                          write_trajectory(folder_ / name("keyframes.txt"), results.key_frames),
                          write(name("map.ply"), format_ply(results.landmarks))})
      if (first && !status) first = std::move(status);
  };
  write_all(main, [](const char* name) { return std::string(name); });
  for (const auto& [sub_map, results] : apart)
    write_all(results, [id = sub_map](const char* name) { return numbered(name, id).string(); });
  if (!first) return first;
  std::error_code code;  // what cannot be removed are poses that are elsewhere as well
  for (const auto& [sub_map, live] : live_)
    if (sub_map != SubMapId(0) && !apart.contains(sub_map))
      fs::remove(numbered(folder_ / "trajectory.txt", sub_map), code);
  return first;
}

}  // namespace semvslam
