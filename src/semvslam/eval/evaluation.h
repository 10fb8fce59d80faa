#pragma once

#include <optional>
#include <string>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/eval/trajectory_error.h"

namespace semvslam {

struct EvaluationOptions {
  double max_gap_s = 0.02;  // between two poses of one moment
  bool with_scale = false;  // align with Sim(3): for estimates without metric scale
  /// How the estimate's world lies to the truth's, where another run in the same world has shown it; else the best.
  std::optional<Sim3> reference_from_estimate;
  RelativeErrorOptions relative;
  /// The moments that had to be tracked (the recording's frames), sorted; where empty, the ground truth's stamps. A
  /// ground truth that is longer than the recording needs them for an honest share.
  std::vector<TimeStamp> frames;
};

/// One estimate measured against the ground truth.
struct Evaluation {
  std::size_t reference_poses = 0, estimate_poses = 0, pairs = 0;
  double tracked_share = 0;  // see share_tracked()
  AbsoluteError absolute;
  RelativeError relative;
};

/// Errors name what cannot be compared: one pose only, no overlap in time (with both time spans), no unique alignment,
/// no step of the asked size. Trajectories must be sorted by stamp (read_trajectory() sorts).
Result<Evaluation> evaluate(const Trajectory& reference, const Trajectory& estimate, const EvaluationOptions& options);

/// An evaluation with its name (the file), for reports.
struct NamedEvaluation {
  std::string name;
  Evaluation evaluation;
};

/// What reports are made of: one estimate, and another one that it is compared with where there is one.
struct EvaluationReport {
  std::string reference_name;
  std::string aligned_as;  // the estimate that the alignment was taken from; empty = each has its own
  EvaluationOptions options;
  NamedEvaluation estimate;
  std::optional<NamedEvaluation> against;
};

/// How the trajectories were aligned, for people: "aligned by SE(3)".
std::string alignment_text(const EvaluationReport& report);
/// A table for people, several lines.
std::string format_text(const EvaluationReport& report);
/// All numbers with full precision, for programs.
std::string format_json(const EvaluationReport& report);
/// A drawing: seen from above (x, y) and from the side (x, z), and the absolute error over time.
std::string format_svg(const EvaluationReport& report);

}  // namespace semvslam
