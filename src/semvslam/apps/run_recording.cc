#include <fmt/core.h>

#include "semvslam/apps/command.h"
#include "semvslam/apps/dense_map.h"
#include "semvslam/apps/run_session.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/sequence.h"
#include "semvslam/eval/evaluation.h"

namespace semvslam {
namespace {

Status score(const Trajectory& truth, const std::string& truth_name, const Trajectory& trajectory,
             const std::filesystem::path& out) {
  EvaluationReport report;
  report.reference_name = truth_name;
  Result<Evaluation> evaluation = evaluate(truth, trajectory, report.options);
  if (!evaluation) {
    fmt::print(stderr, "semvslam: warning: no score: {}\n", evaluation.error().message);
    return Status::success();
  }
  report.estimate = {(out / "trajectory.txt").string(), std::move(*evaluation)};
  fmt::print("{}", format_text(report));
  if (Status status = write_file_atomically(out / "evaluation.json", format_json(report)); !status) return status;
  return write_file_atomically(out / "evaluation.svg", format_svg(report));
}

/// Prints what came of a run. @return as run_recording.
Result<int> conclude(const RunOutcome& outcome, const std::filesystem::path& sequence,
                     const std::filesystem::path& out) {
  Status scored;
  if (const Result<Trajectory> truth = read_ground_truth(sequence); truth)
    scored = score(*truth, sequence.string(), outcome.trajectory, out);
  else if (truth.error().code != ErrorCode::kNotFound)
    fmt::print(stderr, "semvslam: warning: no score: {}\n", truth.error().message);
  fmt::print("results in {}\n", out.string());
  if (outcome.signal != 0) return 128 + outcome.signal;
  if (!outcome.status) return outcome.status.error();
  if (!scored) return scored.error();
  return static_cast<int>(kExitSuccess);
}

}  // namespace

Result<int> run_recording(const std::filesystem::path& sequence, SequenceOptions sequence_options, Config& config,
                          const RunOptions& options) {
  sequence_options.want_colour = config.needs_segmentation() && config.segment.source == "network";
  if (!options.quiet)
    sequence_options.on_warning = [](const std::string& line) { fmt::print(stderr, "semvslam: warning: {}\n", line); };
  Result<std::unique_ptr<FrameSource>> source = open_sequence(sequence, sequence_options);
  if (!source) return source.error();
  Result<RunOutcome> outcome = run_session(std::move(*source), config, options);
  if (!outcome) return outcome.error();
  fmt::print("{}", format_summary(outcome->record, outcome->statistics));
  if (!options.dense_maps.empty()) {
    sequence_options.on_warning = nullptr;  // said before
    const auto make = [&](const SubMapResults& results, const std::vector<std::filesystem::path>& files) {
      if (results.key_frames.empty()) return;
      const Result<DenseMapSummary> dense =
          make_dense_map(sequence, sequence_options, results.key_frames, results.key_frame_masks, config.dense, files);
      if (dense) fmt::print("{}", format_summary(*dense));
      if (!dense && outcome->status) outcome->status = dense.error();
    };
    make(*outcome, options.dense_maps);
    for (const auto& [sub_map, results] : outcome->apart) {
      std::vector<std::filesystem::path> files;
      for (const std::filesystem::path& file : options.dense_maps) files.push_back(numbered(file, sub_map));
      make(results, files);
    }
  }
  return conclude(*outcome, sequence, options.out);
}

}  // namespace semvslam
