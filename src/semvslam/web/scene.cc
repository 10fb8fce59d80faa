#include "semvslam/web/scene.h"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>

#include "semvslam/web/packing.h"

namespace semvslam {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPictureWeight = 0.005;  // x axes of a camera that turned by some ten degrees weigh more
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

double seconds_between(TimeStamp from, TimeStamp to) { return static_cast<double>(to.ns - from.ns) * 1e-9; }

/// x y z and quaternion x y z w of a pose.
std::array<double, 7> numbers_of(const SE3& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Trajectory thinned(const Trajectory& trajectory, std::size_t most) {
  Trajectory out;
  for (const std::size_t i : evenly(trajectory.size(), most)) out.push_back(trajectory[i]);
  return out;
}

Json poses_to_json(const Trajectory& trajectory, TimeStamp start) {
  std::vector<float> times_s, numbers;
  for (const StampedPose& p : trajectory) {
    times_s.push_back(static_cast<float>(seconds_between(start, p.stamp)));
    for (const double number : numbers_of(p.world_from_camera)) numbers.push_back(static_cast<float>(number));
  }
  return {{"times", packed(times_s)}, {"poses", packed(numbers)}};
}

/// Of each pose; NaN where it has no true counterpart.
std::vector<float> errors_of(const Trajectory& trajectory, const AbsoluteError& error) {
  std::vector<float> errors_m;
  std::size_t k = 0;  // both are sorted by stamp
  for (const StampedPose& p : trajectory) {
    while (k < error.stamps.size() && error.stamps[k] < p.stamp) ++k;
    const bool has_error = k < error.stamps.size() && error.stamps[k] == p.stamp;
    errors_m.push_back(has_error ? static_cast<float>(error.errors_m[k]) : kNan);
  }
  return errors_m;
}

Json cloud_to_json(const ViewedCloud& cloud) {
  std::vector<Eigen::Vector3f> positions_m;
  std::vector<std::uint8_t> colours;
  for (const PlyVertex& point : cloud.points) {
    positions_m.push_back(point.position_m);
    if (cloud.has_colours) colours.insert(colours.end(), point.rgb.begin(), point.rgb.end());
  }
  const QuantisedPoints points = quantised(positions_m);
  const auto triple = [](const Eigen::Vector3d& v) { return Json{v.x(), v.y(), v.z()}; };
  return {{"what", cloud.what},
          {"inFile", cloud.in_file},
          {"cell", cloud.cell_m},
          {"origin", triple(points.origin_m)},
          {"step", triple(points.step_m)},
          {"grid", packed(points.grid)},
          {"colours", base64(colours)}};
}

/// All start together where their times overlap (the same recording), else each has a start of its own.
std::vector<TimeStamp> starts_of(const std::vector<ViewedRun>& runs) {
  std::vector<TimeStamp> starts;
  TimeStamp first{std::numeric_limits<std::int64_t>::max()}, last_start{std::numeric_limits<std::int64_t>::min()};
  TimeStamp first_end = first;
  for (const ViewedRun& run : runs) {
    starts.push_back(run.trajectory.empty() ? TimeStamp{} : run.trajectory.front().stamp);
    if (run.trajectory.empty()) continue;
    first = std::min(first, starts.back());
    last_start = std::max(last_start, starts.back());
    first_end = std::min(first_end, run.trajectory.back().stamp);
  }
  if (last_start <= first_end)
    for (TimeStamp& start : starts) start = first;
  return starts;
}

Json run_to_json(const ViewedRun& run, TimeStamp start, std::size_t most_poses) {
  const Trajectory shown = thinned(run.trajectory, most_poses);
  Json json = {{"name", run.name}, {"trajectory", poses_to_json(shown, start)}};
  json["errors"] = run.evaluation ? packed(errors_of(shown, run.evaluation->absolute)) : std::string();
  json["truth"] = poses_to_json(thinned(run.truth, most_poses), start);
  json["keyFrames"] = poses_to_json(thinned(run.key_frames, most_poses), start);
  json["cloud"] = cloud_to_json(run.cloud);
  return json;
}

/// '<' stands in JSON only inside strings.
std::string without_tags(const std::string& json) {
  std::string out;
  out.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      out += "\\u003c";
    else
      out += c;
  }
  return out;
}

}  // namespace

Eigen::Vector3d up_of(const std::vector<ViewedRun>& runs) {
  Eigen::Vector3d up_in_pictures = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sideways = Eigen::Matrix3d::Zero();
  double poses = 0;
  for (const ViewedRun& run : runs)
    for (const StampedPose& p : run.trajectory) {
      const Eigen::Matrix3d axes = p.world_from_camera.rotation_matrix();
      up_in_pictures -= axes.col(1);
      sideways += axes.col(0) * axes.col(0).transpose();
      ++poses;
    }
  if (poses == 0) return -Eigen::Vector3d::UnitY();
  up_in_pictures /= poses;
  // A camera that hardly turned leaves a whole plane square to its x axis: then the pictures decide.
  const Eigen::Matrix3d cost = sideways / poses - kPictureWeight * up_in_pictures * up_in_pictures.transpose();
  const Eigen::Vector3d up = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(cost).eigenvectors().col(0);  // least cost
  return up.dot(up_in_pictures) < 0 ? Eigen::Vector3d(-up) : up;
}

std::vector<std::size_t> evenly(std::size_t n, std::size_t most) {
  std::vector<std::size_t> out;
  const std::size_t count = std::min(n, most);
  for (std::size_t i = 1; i <= count; ++i) out.push_back(i * n / count - 1);
  return out;
}

std::string format_scene(const Scene& scene) {
  const std::vector<TimeStamp> starts = starts_of(scene.runs);
  const Eigen::Vector3d up = up_of(scene.runs);
  Json runs = Json::array();
  for (std::size_t i = 0; i < scene.runs.size(); ++i)
    runs.push_back(run_to_json(scene.runs[i], starts[i], kMostShownPoses / scene.runs.size()));
  Json json = {{"up", {up.x(), up.y(), up.z()}}, {"inTruthWorld", scene.in_truth_world}, {"runs", runs}};
  if (scene.live) json["live"] = {{"generation", scene.live->generation}, {"poses", scene.live->poses}};
  // Names of folders need not be UTF-8: a byte that is none becomes a replacement character instead of an exception.
  return without_tags(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string format_live_pose(const StampedPose& pose, TimeStamp start) {
  std::string out = fmt::format("[{:.6f}", seconds_between(start, pose.stamp));
  for (const double number : numbers_of(pose.world_from_camera)) out += fmt::format(",{:.6g}", number);
  return out + "]";
}

}  // namespace semvslam
