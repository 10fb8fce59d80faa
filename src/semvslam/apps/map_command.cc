#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "semvslam/apps/command.h"
#include "semvslam/apps/map_report.h"
#include "semvslam/apps/run_output.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/map/map_file.h"

namespace semvslam {
namespace {

struct MapArguments {
  std::string file, json, out, trajectory;
};

Result<int> show(const MapArguments& a) {
  const Result<Map> map = read_map(a.file);
  if (!map) return map.error();
  std::error_code code;
  const MapReport report = report_of(*map, a.file, std::filesystem::file_size(a.file, code));
  if (code) return Error{ErrorCode::kIo, fmt::format("{}: cannot read: {}", a.file, code.message())};
  if (a.json != "-") fmt::print("{}", format_text(report));
  if (!a.json.empty())
    if (const Status status = write_report(a.json, format_json(report)); !status) return status.error();
  return static_cast<int>(kExitSuccess);
}

Result<int> export_map(const MapArguments& a) {
  const Result<Map> map = read_map(a.file);
  if (!map) return map.error();
  if (!a.out.empty()) {
    const std::vector<Eigen::Vector3d> points = map->landmark_positions();
    if (const Status status = write_file_atomically(a.out, format_ply(points)); !status) return status.error();
    fmt::print("{}: {} landmarks\n", a.out, points.size());
  }
  if (!a.trajectory.empty()) {
    Trajectory poses;
    for (const auto& [id, key_frame] : map->key_frames())
      poses.push_back({key_frame.stamp, key_frame.camera_from_world.inverse()});
    if (const Status status = write_trajectory(a.trajectory, poses); !status) return status.error();
    fmt::print("{}: {} key frames\n", a.trajectory, poses.size());
  }
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_map(CLI::App& parser) {
  auto a = std::make_shared<MapArguments>();
  parser.require_subcommand(0, 1);
  parser.callback([&parser] {
    if (parser.get_subcommands().empty()) throw CLI::RequiredError("map: info or export");
  });
  CLI::App* info = parser.add_subcommand("info", "what a map file holds: key frames, landmarks, extent, camera, when");
  info->add_option("FILE", a->file, "map that run --save-map wrote")->required();
  info->add_option("--json", a->json, "write it to this file as JSON (- = standard output, alone)");

  CLI::App* exported = parser.add_subcommand("export", "landmarks and key-frame poses for other programs");
  exported->add_option("FILE", a->file, "map that run --save-map wrote")->required();
  exported->add_option("--out", a->out, "file for the landmarks: binary PLY, metres");
  exported->add_option("--trajectory", a->trajectory,
                       "file for the key frames' poses: 't tx ty tz qx qy qz qw', world from camera, by number");
  exported->callback([a] {
    if (a->out.empty() && a->trajectory.empty()) throw CLI::RequiredError("map export: --out or --trajectory");
  });
  return [a, info] { return info->parsed() ? show(*a) : export_map(*a); };
}

}  // namespace semvslam
