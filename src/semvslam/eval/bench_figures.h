#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/eval/bench_results.h"
#include "semvslam/eval/evaluation.h"

namespace semvslam {

/// What is drawn of one mode on a recording: one run's whole evaluation.
struct DrawnRun {
  std::string mode;
  int number = 1;
  Evaluation evaluation;
};

/// The runs on one recording that are drawn beside each other.
struct DrawnSequence {
  std::string sequence;
  std::vector<DrawnRun> runs;
};

inline constexpr const char* kDrawnDifferenceColour = "#e05050";

/// "#rrggbb", the same for a mode in every figure.
std::string mode_colour(std::string_view mode);

/// For each run the truth, the estimate and what lies between them, in the plane in which the truth extends most; a
/// whole SVG document. There must be a run.
std::string draw_trajectories(const DrawnSequence& drawn);

/// ATE, relative translation and relative rotation over time, all runs in each; a whole SVG document.
std::string draw_errors_over_time(const DrawnSequence& drawn);

/// A published system that is drawn beside our modes, and the grey that it has there.
struct DrawnSystem {
  std::string_view name;
  const char* colour;
};
/// Those where a recording is one of the paper's; none elsewhere.
std::span<const DrawnSystem> drawn_systems(const BenchResults& results);

/// Bars over sequences and modes: RMSE and SD of the three errors (as Figures 11 to 13 of the paper), and, where a
/// recording is one of the paper's, the ATE RMSE beside published ones (Figure 18). Whole SVG documents; none without a
/// score.
std::vector<std::string> draw_error_bars(const BenchResults& results);

}  // namespace semvslam
