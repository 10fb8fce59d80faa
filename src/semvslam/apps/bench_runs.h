#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/apps/bench_suite.h"
#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/eval/bench_results.h"
#include "semvslam/eval/evaluation.h"

namespace semvslam {

/// One call of `semvslam run`.
struct PlannedRun {
  std::size_t recording = 0;  // index into the list of recordings
  std::string sequence, mode;
  int number = 1;                      // of the repeats, from 1
  std::vector<std::string> arguments;  // of the program, all but --out
  std::string camera_file;             // that the arguments name; empty = none
  std::string folder;                  // of its files, relative to the bench's: runs/SEQUENCE/MODE/NUMBER
};

/// Recording by recording; of each first all modes once, then all modes again: whatever else happens on the machine
/// meets all modes alike. @param recordings must have their folders
std::vector<PlannedRun> plan_runs(const BenchSuite& suite, const std::vector<BenchRecording>& recordings);

/// The true poses of a recording, where it has any.
struct BenchTruth {
  std::optional<Trajectory> poses;
  double way_m = 0;     // length of the way from pose to pose
  std::string trouble;  // why the poses that are there cannot be used; empty = nothing is wrong
};
BenchTruth read_truth(const std::filesystem::path& recording);

/// The program that runs, and what tells it from an earlier build of it.
struct BenchProgram {
  std::string path;      // to start
  std::string identity;  // changes with the version, the program's file and the network's weights

  /// This process's own. Errors: its file cannot be read.
  static Result<BenchProgram> self();
};

/// Executes planned runs, each as a process of its own, or takes over what an earlier call left.
class BenchRunner {
 public:
  /// @param out the bench's folder. @param again repeats runs that are complete, too
  BenchRunner(BenchProgram program, std::filesystem::path out, bool again, EvaluationOptions scoring);

  struct Outcome {
    BenchRun run;
    bool kept = false;         // from an earlier call: nothing was run
    bool interrupted = false;  // by a signal to this process; the run does not count
    std::string no_score;      // why a run with a true way has no errors
  };
  /// A run is kept when it ended well with the same arguments, program, weights and recording. What a run leaves in its
  /// folder: trajectory.txt, stats.json, evaluation.json, config.yaml, run.log, and output.log with all that it
  /// printed. A child that fails, crashes or cannot start is an Outcome with a failure. Errors: the bench's own files
  /// cannot be written.
  Result<Outcome> perform(const PlannedRun& plan, const std::filesystem::path& recording, const BenchTruth& truth);

  /// The whole evaluation of a run that perform() gave, for drawing.
  Result<Evaluation> evaluate_run(const BenchRun& run, const BenchTruth& truth) const;

 private:
  std::string identity_of(const PlannedRun& plan, const std::filesystem::path& recording) const;
  void score(const BenchTruth& truth, Outcome& outcome) const;

  const BenchProgram program_;
  const std::filesystem::path out_;
  const bool again_;
  const EvaluationOptions scoring_;
};

/// Fills the numbers of a run from its stats.json. Errors: that is not what `semvslam run` writes at the end of a
/// complete run.
Status read_statistics(const std::string& text, BenchRun& run);

}  // namespace semvslam
