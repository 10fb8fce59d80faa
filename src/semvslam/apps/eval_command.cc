#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "semvslam/apps/command.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/data/tum_files.h"
#include "semvslam/eval/evaluation.h"

namespace semvslam {
namespace {

struct EvalArguments {
  std::string reference, estimate, against, delta = "1s", json, plot, frames;
  std::vector<std::string> aligned_as;  // ground truth and estimate of another run in the same world, or nothing
  bool with_scale = false, consecutive = false;
  double max_gap_s = 0.02;
};

Error about(const std::string& file, const Error& error) { return {error.code, file + ": " + error.message}; }

Result<NamedEvaluation> evaluate_file(const std::string& file, const std::string& reference_file,
                                      const Trajectory& reference, const EvaluationOptions& options) {
  const Result<Trajectory> estimate = read_trajectory(file);
  if (!estimate) return estimate.error();
  Result<Evaluation> evaluation = evaluate(reference, *estimate, options);
  if (!evaluation) return about(file + " against " + reference_file, evaluation.error());
  return NamedEvaluation{file, std::move(*evaluation)};
}

Result<std::vector<TimeStamp>> read_stamps(const std::string& file) {
  const Result<std::string> text = read_text_file(file);
  if (!text) return text.error();
  const Result<FileList> list = parse_file_list(*text, file);
  if (!list) return list.error();
  std::vector<TimeStamp> stamps;
  for (const TimedFile& entry : list->entries) stamps.push_back(entry.stamp);
  if (stamps.empty()) return Error{ErrorCode::kInvalidInput, file + ": no frame in it"};
  return stamps;
}

/// How the world of an estimate lies to that of its ground truth.
Result<Sim3> alignment_of(const std::string& reference_file, const std::string& file,
                          const EvaluationOptions& options) {
  const Result<Trajectory> reference = read_trajectory(reference_file);
  if (!reference) return reference.error();
  const Result<Trajectory> estimate = read_trajectory(file);
  if (!estimate) return estimate.error();
  const Result<AbsoluteError> error =
      absolute_error(*reference, *estimate, pair_by_time(*reference, *estimate, options.max_gap_s), options.with_scale);
  if (!error) return about(file + " against " + reference_file, error.error());
  return error->reference_from_estimate;
}

Result<int> run_eval(const EvalArguments& arguments) {
  EvaluationReport report;
  report.reference_name = arguments.reference;
  report.options.max_gap_s = arguments.max_gap_s;
  report.options.with_scale = arguments.with_scale;
  report.options.relative.overlapping = !arguments.consecutive;
  const Result<Delta> delta = Delta::parse(arguments.delta);
  if (!delta) return delta.error();
  report.options.relative.delta = *delta;
  if (!arguments.frames.empty()) {
    Result<std::vector<TimeStamp>> stamps = read_stamps(arguments.frames);
    if (!stamps) return stamps.error();
    report.options.frames = std::move(*stamps);
  }

  if (!arguments.aligned_as.empty()) {
    const Result<Sim3> alignment = alignment_of(arguments.aligned_as[0], arguments.aligned_as[1], report.options);
    if (!alignment) return alignment.error();
    report.options.reference_from_estimate = *alignment;
    report.aligned_as = arguments.aligned_as[1];
  }

  const Result<Trajectory> reference = read_trajectory(arguments.reference);
  if (!reference) return reference.error();
  Result<NamedEvaluation> estimate = evaluate_file(arguments.estimate, arguments.reference, *reference, report.options);
  if (!estimate) return estimate.error();
  report.estimate = std::move(*estimate);
  if (!arguments.against.empty()) {
    Result<NamedEvaluation> against = evaluate_file(arguments.against, arguments.reference, *reference, report.options);
    if (!against) return against.error();
    report.against = std::move(*against);
  }

  if (arguments.json != "-" && arguments.plot != "-") fmt::print("{}", format_text(report));
  if (!arguments.json.empty())
    if (const Status status = write_report(arguments.json, format_json(report)); !status) return status.error();
  if (!arguments.plot.empty())
    if (const Status status = write_report(arguments.plot, format_svg(report)); !status) return status.error();
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_eval(CLI::App& parser) {
  auto a = std::make_shared<EvalArguments>();
  parser.add_option("GROUND_TRUTH", a->reference, "TUM trajectory: 't tx ty tz qx qy qz qw' per line")->required();
  parser.add_option("ESTIMATE", a->estimate, "TUM trajectory to be measured")->required();
  parser.add_option("--against", a->against, "a second estimate; prints the improvement over it in percent");
  parser.add_option("--delta", a->delta, "step of the relative error: seconds (1s) or frames (1f)")
      ->capture_default_str();
  parser.add_flag("--consecutive", a->consecutive,
                  "relative error over steps that follow each other, not overlapping ones");
  parser.add_flag("--scale", a->with_scale, "align with scale (Sim3), for estimates that have none");
  parser
      .add_option("--aligned-as", a->aligned_as,
                  "ground truth and estimate of another run in the same world, as of the one that made a saved map: "
                  "align as that one is")
      ->type_name("GROUND_TRUTH ESTIMATE")
      ->expected(2);
  parser.add_option("--max-gap", a->max_gap_s, "largest time between two poses of one moment, seconds")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  parser.add_option("--frames", a->frames, "rgb.txt of the recording: the share tracked is then of these frames");
  parser.add_option("--json", a->json, "write all numbers to this file (- = standard output, alone)");
  parser.add_option("--plot", a->plot, "draw trajectories and errors to this SVG file (- = standard output, alone)");
  return [a] { return run_eval(*a); };
}

}  // namespace semvslam
