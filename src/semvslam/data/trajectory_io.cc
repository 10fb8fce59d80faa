#include "semvslam/data/trajectory_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "semvslam/data/text_scan.h"

namespace semvslam {
namespace {

constexpr std::size_t kWordsPerLine = 8;
constexpr const char* kHeader = "# timestamp tx ty tz qx qy qz qw\n";

/// Empty when the line is good, else what is wrong with it.
std::string parse_line(const TextLine& line, StampedPose& pose) {
  const std::vector<std::string_view> words = split_words(line.text);
  if (words.size() != kWordsPerLine)
    return fmt::format("expected 8 numbers 't tx ty tz qx qy qz qw', got {} words{}", words.size(),
                       line.terminated ? "" : " (the file breaks off here; delete this line to use the rest)");
  const std::optional<TimeStamp> stamp = parse_seconds(words[0]);
  if (is_non_finite_word(words[0])) return "the time stamp is not a finite number";
  if (!stamp) return "the first word is no time stamp in decimal seconds";
  double v[kWordsPerLine];
  for (std::size_t i = 1; i < kWordsPerLine; ++i) {
    const std::optional<double> value = parse_double(words[i]);
    if (!value) return fmt::format("word {} is not a number", i + 1);
    if (!std::isfinite(*value)) return fmt::format("word {} is not a finite number", i + 1);
    v[i] = *value;
  }
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  if (!(rotation.norm() > 1e-6) || !std::isfinite(rotation.squaredNorm()))
    return "the quaternion has no direction (its length must be 1)";
  pose = {*stamp, SE3(rotation, {v[1], v[2], v[3]})};
  return {};
}

}  // namespace

Result<ParsedTrajectory> parse_trajectory(std::string_view text, const std::string& name) {
  ParsedTrajectory parsed;
  for (const TextLine& line : content_lines(text)) {
    StampedPose pose;
    if (const std::string fault = parse_line(line, pose); !fault.empty())
      return Error{ErrorCode::kInvalidInput, fmt::format("{}:{}: {}", name, line.number, fault)};
    if (!parsed.poses.empty() && pose.stamp < parsed.poses.back().stamp) ++parsed.out_of_order;
    parsed.poses.push_back(pose);
  }
  if (parsed.out_of_order > 0)
    std::stable_sort(parsed.poses.begin(), parsed.poses.end(),
                     [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
  const auto end = std::unique(parsed.poses.begin(), parsed.poses.end(),
                               [](const StampedPose& a, const StampedPose& b) { return a.stamp == b.stamp; });
  parsed.duplicates = static_cast<std::size_t>(parsed.poses.end() - end);
  parsed.poses.erase(end, parsed.poses.end());
  return parsed;
}

Result<Trajectory> read_trajectory(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.error();
  Result<ParsedTrajectory> parsed = parse_trajectory(*text, path.string());
  if (!parsed) return parsed.error();
  if (parsed->poses.empty())
    return Error{ErrorCode::kInvalidInput, path.string() + ": no pose in it (expected lines 't tx ty tz qx qy qz qw')"};
  return std::move(parsed->poses);
}

std::string format_pose_line(const StampedPose& pose) {
  const Eigen::Vector3d& t = pose.world_from_camera.translation();
  Eigen::Quaterniond q = pose.world_from_camera.rotation();
  if (q.w() < 0) q.coeffs() = -q.coeffs();  // one spelling of each rotation
  return fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", format_seconds(pose.stamp), t.x(), t.y(),
                     t.z(), q.x(), q.y(), q.z(), q.w());
}

Status write_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  std::string text = kHeader;
  for (const StampedPose& pose : trajectory) text += format_pose_line(pose);
  return write_file_atomically(path, text);
}

Result<AppendingTrajectoryWriter> AppendingTrajectoryWriter::create(const std::filesystem::path& path) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  AppendingTrajectoryWriter writer(std::move(*file));
  writer.pending_ = kHeader;
  if (Status s = writer.write_pending(); !s) return s.error();
  return writer;
}

Status AppendingTrajectoryWriter::append(const StampedPose& pose) {
  pending_ += format_pose_line(pose);
  return write_pending();
}

Status AppendingTrajectoryWriter::write_pending() {
  if (Status s = file_.write(pending_); !s) return s;
  pending_.clear();
  return Status::success();
}

}  // namespace semvslam
