#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "semvslam/eval/evaluation.h"

namespace semvslam {
namespace {

using Json = nlohmann::ordered_json;

std::string table_row(const std::string& name, const ErrorStatistics& s) {
  return fmt::format("{:<22}{:>11.6f}{:>11.6f}{:>11.6f}{:>11.6f}{:>11.6f}{:>11.6f}\n", name, s.rmse, s.mean, s.median,
                     s.sd, s.min, s.max);
}

std::string gain_row(const std::string& name, const ErrorStatistics& other, const ErrorStatistics& ours) {
  const auto gain = [](double o, double m) { return fmt::format("{:.2f}%", improvement_percent(o, m)); };
  return fmt::format("{:<22}{:>11}{:>11}{:>11}{:>11}{:>11}{:>11}\n", name, gain(other.rmse, ours.rmse),
                     gain(other.mean, ours.mean), gain(other.median, ours.median), gain(other.sd, ours.sd),
                     gain(other.min, ours.min), gain(other.max, ours.max));
}

std::string block(const NamedEvaluation& named, const EvaluationReport& report) {
  const Evaluation& e = named.evaluation;
  const std::string of = report.options.frames.empty() ? "of the ground truth's poses" : "of the frames";
  std::string out = fmt::format("{}\n  {} of {} poses paired, tracked {:.2f} % {}", named.name, e.pairs,
                                e.estimate_poses, 100 * e.tracked_share, of);
  if (report.options.with_scale) out += fmt::format(", scale {:.6f}", e.absolute.reference_from_estimate.scale);
  const std::string delta = report.options.relative.delta.text();
  out += '\n';
  out += table_row("  ATE (m)", e.absolute.statistics_m);
  out += table_row(fmt::format("  RPE {} (m)", delta), e.relative.translation_m);
  out += table_row(fmt::format("  RPE {} (deg)", delta), e.relative.rotation_deg);
  return out;
}

Json to_json(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"sd", s.sd},
          {"min", s.min},   {"max", s.max},   {"count", s.count}};
}

Json to_json(const NamedEvaluation& named) {
  const Evaluation& e = named.evaluation;
  return {{"file", named.name},
          {"poses", e.estimate_poses},
          {"paired", e.pairs},
          {"tracked_share", e.tracked_share},
          {"scale", e.absolute.reference_from_estimate.scale},
          {"ate_m", to_json(e.absolute.statistics_m)},
          {"rpe_translation_m", to_json(e.relative.translation_m)},
          {"rpe_rotation_deg", to_json(e.relative.rotation_deg)}};
}

Json gains(const ErrorStatistics& other, const ErrorStatistics& ours) {
  const auto gain = [](double o, double m) {
    const double percent = improvement_percent(o, m);
    return std::isfinite(percent) ? Json(percent) : Json(nullptr);
  };
  return {{"rmse", gain(other.rmse, ours.rmse)},       {"mean", gain(other.mean, ours.mean)},
          {"median", gain(other.median, ours.median)}, {"sd", gain(other.sd, ours.sd)},
          {"min", gain(other.min, ours.min)},          {"max", gain(other.max, ours.max)}};
}

}  // namespace

std::string alignment_text(const EvaluationReport& report) {
  if (!report.aligned_as.empty()) return "aligned as " + report.aligned_as;
  return report.options.with_scale ? "aligned by Sim(3)" : "aligned by SE(3)";
}

std::string format_text(const EvaluationReport& report) {
  std::string out = fmt::format("ground truth {} ({} poses), {}\n", report.reference_name,
                                report.estimate.evaluation.reference_poses, alignment_text(report));
  out += fmt::format("{:<22}{:>11}{:>11}{:>11}{:>11}{:>11}{:>11}\n", "", "RMSE", "mean", "median", "SD", "min", "max");
  out += block(report.estimate, report);
  if (!report.against) return out;
  out += block(*report.against, report);
  const Evaluation& ours = report.estimate.evaluation;
  const Evaluation& other = report.against->evaluation;
  out += fmt::format("improvement of {} over {}\n", report.estimate.name, report.against->name);
  out += gain_row("  ATE", other.absolute.statistics_m, ours.absolute.statistics_m);
  out += gain_row("  RPE translation", other.relative.translation_m, ours.relative.translation_m);
  out += gain_row("  RPE rotation", other.relative.rotation_deg, ours.relative.rotation_deg);
  return out;
}

std::string format_json(const EvaluationReport& report) {
  Json json = {
      {"ground_truth", {{"file", report.reference_name}, {"poses", report.estimate.evaluation.reference_poses}}},
      {"alignment", report.options.with_scale ? "sim3" : "se3"},
      {"max_gap_s", report.options.max_gap_s},
      {"rpe_delta", report.options.relative.delta.text()},
      {"rpe_overlapping_steps", report.options.relative.overlapping},
      {"estimate", to_json(report.estimate)}};
  if (!report.aligned_as.empty()) json["aligned_as"] = report.aligned_as;
  if (report.against) {
    const Evaluation& ours = report.estimate.evaluation;
    const Evaluation& other = report.against->evaluation;
    json["against"] = to_json(*report.against);
    json["improvement_percent"] = {
        {"ate", gains(other.absolute.statistics_m, ours.absolute.statistics_m)},
        {"rpe_translation", gains(other.relative.translation_m, ours.relative.translation_m)},
        {"rpe_rotation", gains(other.relative.rotation_deg, ours.relative.rotation_deg)}};
  }
  // File names need not be UTF-8: a byte that is none becomes a replacement character instead of an exception.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace semvslam
