#include "semvslam/web/viewed_run.h"

#include <fmt/core.h>

#include <algorithm>

#include "semvslam/data/file_io.h"
#include "semvslam/data/sequence.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/web/point_thinner.h"
#include "semvslam/web/run_facts.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostJsonBytes = 1 << 20;
constexpr std::int64_t kTruthMargin_ns = 500'000'000;

Result<Trajectory> read_poses(const fs::path& folder, bool live) {
  const fs::path file = folder / "trajectory.txt";
  Result<std::string> text = read_text_file(file);
  if (!text && text.error().code == ErrorCode::kNotFound) {
    if (live) return Trajectory{};
    return Error{ErrorCode::kNotFound,
                 fmt::format("{}: holds no run (no trajectory.txt); name a folder that 'semvslam run --out' wrote",
                             folder.string())};
  }
  if (!text) return text.error();
  if (live) text->erase(text->find_last_of('\n') + 1);  // the last line may still be growing
  Result<ParsedTrajectory> parsed = parse_trajectory(*text, file.string());
  if (!parsed) return parsed.error();
  return std::move(parsed->poses);
}

std::string read_json(const fs::path& file, ViewedRun& run) {
  Result<std::string> text = read_text_file(file, kMostJsonBytes);
  if (text) return std::move(*text);
  if (text.error().code != ErrorCode::kNotFound) run.remarks.push_back(text.error().message);
  return "";
}

Result<ViewedCloud> read_cloud(const fs::path& file, const std::string& what, std::size_t most_points) {
  PointThinner thinner(most_points);
  const Result<PlyHeader> header = read_ply(file, [&](const PlyVertex& point) { thinner.add(point); });
  if (!header) return header.error();
  return ViewedCloud{
      what, thinner.points(), header->has_colours, thinner.given(), thinner.unusable(), thinner.cell_m()};
}

/// The cloud that was named, else the dense map, else the landmarks.
Status add_cloud(const fs::path& folder, const ViewOptions& options, ViewedRun& run) {
  if (!options.dense.empty()) {
    Result<ViewedCloud> cloud = read_cloud(options.dense, options.dense.filename().string(), options.most_points);
    if (!cloud) return cloud.error();
    run.cloud = std::move(*cloud);
    return Status::success();
  }
  constexpr std::pair<const char*, const char*> kClouds[] = {{"dense.ply", "dense map"}, {"map.ply", "landmarks"}};
  for (const auto& [name, what] : kClouds) {
    Result<ViewedCloud> cloud = read_cloud(folder / name, what, options.most_points);
    if (cloud) {
      run.cloud = std::move(*cloud);
      return Status::success();
    }
    if (cloud.error().code != ErrorCode::kNotFound) run.remarks.push_back(cloud.error().message);
  }
  run.remarks.push_back(options.live ? "no map yet" : "no points: neither map.ply nor dense.ply can be shown");
  return Status::success();
}

Trajectory during(const Trajectory& truth, const Trajectory& trajectory) {
  Trajectory out;
  const std::int64_t from_ns = trajectory.front().stamp.ns - kTruthMargin_ns;
  const std::int64_t to_ns = trajectory.back().stamp.ns + kTruthMargin_ns;
  std::copy_if(truth.begin(), truth.end(), std::back_inserter(out),
               [&](const StampedPose& p) { return p.stamp.ns >= from_ns && p.stamp.ns <= to_ns; });
  return out;
}

/// Scores the run once more, for the error of every pose. Only a truth that the user named must be usable.
Status add_evaluation(const fs::path& folder, const ViewOptions& options, ViewedRun& run) {
  const bool is_named = !options.truth.empty();
  const fs::path file = is_named ? options.truth : fs::path(named_ground_truth(run.evaluation_json).value_or(""));
  if (file.empty() || run.trajectory.empty()) return Status::success();
  const auto give_up = [&](const Error& error) -> Status {
    if (is_named) return error;
    run.remarks.push_back(
        fmt::format("no error per pose: {} (name where the ground truth is now with --truth)", error.message));
    return Status::success();
  };
  const Result<Trajectory> truth = read_ground_truth(file);
  if (!truth) return give_up(truth.error());
  EvaluationReport report;
  Result<Evaluation> evaluation = evaluate(*truth, run.trajectory, report.options);
  if (!evaluation) return give_up(evaluation.error());
  run.truth = during(*truth, run.trajectory);
  run.evaluation = *evaluation;
  if (is_named) {
    report.reference_name = file.string();
    report.estimate = {(folder / "trajectory.txt").string(), std::move(*evaluation)};
    run.evaluation_json = format_json(report);
  }
  return Status::success();
}

void add_key_frames(const fs::path& folder, ViewedRun& run) {
  Result<Trajectory> key_frames = read_trajectory(folder / "keyframes.txt");
  if (key_frames)
    run.key_frames = std::move(*key_frames);
  else if (key_frames.error().code != ErrorCode::kNotFound)
    run.remarks.push_back(key_frames.error().message);
}

void move(const Sim3& to_from, Trajectory& trajectory) {
  for (StampedPose& p : trajectory)
    p.world_from_camera =
        SE3(to_from.rigid.rotation() * p.world_from_camera.rotation(), to_from * p.world_from_camera.translation());
}

Sim3 inverse(const Sim3& a_from_b) {
  const SE3 back = a_from_b.rigid.inverse();
  return {1 / a_from_b.scale, SE3(back.rotation(), back.translation() / a_from_b.scale)};
}

}  // namespace

Result<ViewedRun> read_run(const fs::path& folder, const ViewOptions& options) {
  std::error_code unseen;  // what cannot be looked at is no folder to us
  if (!fs::is_directory(folder, unseen))
    return Error{ErrorCode::kNotFound, fmt::format("{}: no such folder", folder.string())};
  ViewedRun run;
  const fs::path plain = fs::absolute(folder).lexically_normal();
  run.name = (plain.has_filename() ? plain : plain.parent_path()).filename().string();
  Result<Trajectory> trajectory = read_poses(folder, options.live);
  if (!trajectory) return trajectory.error();
  run.trajectory = std::move(*trajectory);
  if (run.trajectory.empty()) run.remarks.push_back(options.live ? "no pose yet" : "not one frame was tracked");
  run.statistics = read_json(folder / "stats.json", run);
  if (run.statistics.empty()) run.remarks.push_back("no numbers of the run: stats.json is missing");
  run.evaluation_json = read_json(folder / "evaluation.json", run);
  const RunFacts facts = describe_run(run.statistics, run.evaluation_json);
  run.remarks.insert(run.remarks.end(), facts.remarks.begin(), facts.remarks.end());
  add_key_frames(folder, run);
  if (Status status = add_cloud(folder, options, run); !status) return status.error();
  if (options.live && facts.is_running) return run;
  if (Status status = add_evaluation(folder, options, run); !status) return status.error();
  return run;
}

bool bring_together(std::vector<ViewedRun>& runs) {
  const bool all = std::all_of(runs.begin(), runs.end(), [](const ViewedRun& r) { return r.evaluation.has_value(); });
  for (ViewedRun& run : runs) {
    if (!run.evaluation) continue;
    const Sim3& truth_from_run = run.evaluation->absolute.reference_from_estimate;
    if (!all) {
      move(inverse(truth_from_run), run.truth);
      continue;
    }
    move(truth_from_run, run.trajectory);
    move(truth_from_run, run.key_frames);
    for (PlyVertex& point : run.cloud.points)
      point.position_m = (truth_from_run * point.position_m.cast<double>()).cast<float>();
  }
  return all;
}

}  // namespace semvslam
