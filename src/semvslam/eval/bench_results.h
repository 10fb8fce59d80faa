#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "semvslam/eval/statistics.h"

namespace semvslam {

/// The errors of one run's trajectory.
struct RunScore {
  ErrorStatistics ate_m, rpe_translation_m, rpe_rotation_deg;
};

/// How well a run told features on moving things from the static scene's; each a share in [0, 1].
struct TruthShares {
  double kept_on_moving = 0, tracked_on_moving = 0, static_dropped = 0, clear_static_dropped = 0, static_barred = 0;
};

/// One run of the program over one recording.
struct BenchRun {
  std::string sequence, mode;
  int number = 1;       // of the repeats, from 1
  std::string folder;   // of its files, relative to the results
  std::string failure;  // why it did not end well; empty = it did, and the numbers below count
  std::uint64_t frames = 0, tracked = 0, lost = 0, skipped = 0;
  double tracking_mean_ms = 0, tracking_p95_ms = 0, frames_per_s = 0, cpu_ms_per_frame = 0, peak_memory_mb = 0,
         start_up_s = 0, wall_s = 0;
  double way_m = 0;               // length of the true way; 0 = not known
  std::optional<RunScore> score;  // none: no ground truth, or nothing of the trajectory can be compared with it
  std::optional<TruthShares> truth;
};

/// One of a run's numbers, by the name it has in files.
struct BenchNumber {
  std::string_view name;
  std::optional<double> (*of)(const BenchRun& run);
};

/// All of them, in the order of a table's columns.
std::span<const BenchNumber> bench_numbers();
/// The one of that name, which must exist.
const BenchNumber& bench_number(std::string_view name);

/// All runs of one recording in one mode.
struct BenchCell {
  std::string sequence, mode;
  std::vector<const BenchRun*> good, failed;

  /// A number over the good runs that have it.
  Spread over(const BenchNumber& number) const;
  Spread over(std::string_view name) const { return over(bench_number(name)); }
  /// The run with the median ATE RMSE, of an even number the lower of the middle two; null without a score.
  const BenchRun* middle() const;
};

/// What a bench came to.
struct BenchResults {
  std::string name;
  std::vector<std::string> sequences, modes;  // in the order of tables
  std::string baseline;                       // the mode that improvements refer to; empty = none
  std::string rpe_delta = "1s";
  std::vector<std::pair<std::string, std::string>> facts;  // about the machine and the settings: name, value
  std::vector<std::string> remarks;                        // sequences left out, an interrupt
  std::vector<std::string> broken_limits;
  std::vector<BenchRun> runs;
};

/// The runs by sequence and mode, in the order of `sequences` and `modes`; pairs that were not run are left out. The
/// cells point into `results`.
std::vector<BenchCell> cells_of(const BenchResults& results);

/// The cell of a sequence in a mode; null where there is none.
const BenchCell* find_cell(const std::vector<BenchCell>& cells, std::string_view sequence, std::string_view mode);

/// What a run must hold to.
struct BenchLimits {
  std::string mode;                                    // runs of other modes are not bound; empty = all are
  std::optional<double> ate_rmse_m, ate_share_of_way;  // at most
  std::optional<double> tracked_share;                 // at least
};

/// A line for each limit that the run breaks. A run that failed breaks none, it is counted by itself; one without a
/// score breaks the limits on it.
std::vector<std::string> broken_limits(const BenchRun& run, const BenchLimits& limits);

}  // namespace semvslam
