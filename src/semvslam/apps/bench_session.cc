#include "semvslam/apps/bench_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "semvslam/apps/bench_runs.h"
#include "semvslam/apps/command.h"
#include "semvslam/apps/interrupt.h"
#include "semvslam/apps/scene_cache.h"
#include "semvslam/base/machine.h"
#include "semvslam/data/file_io.h"
#include "semvslam/eval/bench_files.h"
#include "semvslam/eval/bench_report.h"
#include "semvslam/eval/table.h"
#include "semvslam/pipeline/presets.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

Status render_scenes(std::vector<BenchRecording>& recordings, const fs::path& out, bool quiet) {
  for (BenchRecording& recording : recordings) {
    if (!recording.scene) continue;
    Result<fs::path> folder = cached_scene(*recording.scene, out, quiet);
    if (!folder) return folder.error();
    recording.folder = std::move(*folder);
  }
  return Status::success();
}

/// The modes of all recordings, in the order in which modes are known.
std::vector<std::string> modes_of(const std::vector<BenchRecording>& recordings) {
  std::set<std::string> used;
  for (const BenchRecording& recording : recordings) used.insert(recording.modes.begin(), recording.modes.end());
  std::vector<std::string> out = mode_names();
  std::erase_if(out, [&](const std::string& mode) { return !used.contains(mode); });
  return out;
}

std::vector<std::pair<std::string, std::string>> facts_of(const BenchSuite& suite) {
  const Machine machine = this_machine();
  std::vector<std::pair<std::string, std::string>> facts = {
      {"program", std::string("semvslam ") + SEMVSLAM_VERSION},
      {"compiler", machine.compiler},
      {"processor", machine.processor.empty() ? "unknown" : machine.processor},
      {"usable cores", std::to_string(machine.usable_cores)},
      {"memory", fmt::format("{:.1f} GB", static_cast<double>(machine.memory_bytes) / 1e9)},
      {"load when it began", fmt::format("{:.2f}", machine.load)},
      {"runs", fmt::format("{} of each, {}", suite.runs, suite.deterministic ? "deterministic" : "threaded")}};
  if (suite.max_frames > 0) facts.emplace_back("frames at most", std::to_string(suite.max_frames));
  for (const std::string& assignment : suite.assignments) facts.emplace_back("set", assignment);
  return facts;
}

std::string progress_line(std::size_t done, std::size_t all, const BenchRunner::Outcome& outcome) {
  const BenchRun& run = outcome.run;
  std::string line = fmt::format("[{}/{}] {}, {}, run {}: ", done, all, run.sequence, run.mode, run.number);
  if (!run.failure.empty()) return line + "failed: " + run.failure;
  if (run.score) line += fmt::format("ATE {} mm, ", three_digits(1e3 * run.score->ate_m.rmse));
  line += fmt::format("{} of {} tracked, {} ms, {} frames/s", run.tracked, run.frames,
                      three_digits(run.tracking_mean_ms), three_digits(run.frames_per_s));
  return line + (outcome.kept ? " (kept)" : "");
}

/// All that a bench works with, and what has come of it so far.
struct Bench {
  BenchSuite suite;
  std::vector<BenchRecording> recordings;
  std::vector<BenchTruth> truths;  // one per recording
  BenchResults results;
  fs::path out;
  bool quiet = false;
};

/// @return an Error only when the bench cannot go on; an interrupt ends it early and is a success here.
Status run_all(BenchRunner& runner, Bench& bench) {
  const std::vector<PlannedRun> plans = plan_runs(bench.suite, bench.recordings);
  for (std::size_t i = 0; i < plans.size() && InterruptGuard::received() == 0; ++i) {
    const BenchRecording& recording = bench.recordings[plans[i].recording];
    const auto outcome = runner.perform(plans[i], recording.folder, bench.truths[plans[i].recording]);
    if (!outcome) return outcome.error();
    if (outcome->interrupted) break;
    if (!bench.quiet) fmt::print(stderr, "{}\n", progress_line(i + 1, plans.size(), *outcome));
    if (!outcome->no_score.empty())
      bench.results.remarks.push_back(fmt::format("{}, {}, run {} has no score: {}", plans[i].sequence, plans[i].mode,
                                                  plans[i].number, outcome->no_score));
    for (std::string& line : broken_limits(outcome->run, recording.limits))
      bench.results.broken_limits.push_back(std::move(line));
    bench.results.runs.push_back(outcome->run);
  }
  if (InterruptGuard::received() != 0)
    bench.results.remarks.push_back(fmt::format("Interrupted after {} of {} runs; the same command goes on from there.",
                                                bench.results.runs.size(), plans.size()));
  return Status::success();
}

std::vector<DrawnSequence> draw(const BenchRunner& runner, const Bench& bench) {
  std::vector<DrawnSequence> out;
  const std::vector<BenchCell> cells = cells_of(bench.results);
  for (std::size_t i = 0; i < bench.recordings.size(); ++i) {
    DrawnSequence drawn{bench.recordings[i].name, {}};
    for (const std::string& mode : bench.results.modes) {
      const BenchCell* cell = find_cell(cells, drawn.sequence, mode);
      const BenchRun* run = cell == nullptr ? nullptr : cell->middle();
      if (run == nullptr) continue;
      if (Result<Evaluation> e = runner.evaluate_run(*run, bench.truths[i]); e)
        drawn.runs.push_back({mode, run->number, std::move(*e)});
    }
    if (!drawn.runs.empty()) out.push_back(std::move(drawn));
  }
  return out;
}

Status write_all(const Bench& bench, const std::vector<DrawnSequence>& drawn) {
  const std::pair<const char*, std::string> files[] = {{"results.json", to_json(bench.results)},
                                                       {"results.csv", to_csv(bench.results)},
                                                       {"tables.md", to_markdown(bench.results)},
                                                       {"report.html", to_html(bench.results, drawn)}};
  Status first;
  for (const auto& [name, content] : files)
    if (Status status = write_file_atomically(bench.out / name, content); first && !status) first = std::move(status);
  return first;
}

int exit_code(const BenchResults& results) {
  if (InterruptGuard::received() != 0) return 128 + InterruptGuard::received();
  const bool failed =
      std::any_of(results.runs.begin(), results.runs.end(), [](const BenchRun& run) { return !run.failure.empty(); });
  return failed || !results.broken_limits.empty() ? kExitInternal : kExitSuccess;
}

Result<int> execute(Bench& bench, bool again) {
  Result<BenchProgram> program = BenchProgram::self();
  if (!program) return program.error();
  EvaluationOptions scoring;
  scoring.relative.delta = bench.suite.rpe_delta;
  const InterruptGuard interrupt;
  BenchRunner runner(std::move(*program), bench.out, again, scoring);
  const Status ran = run_all(runner, bench);
  const Status written = write_all(bench, draw(runner, bench));
  fmt::print("{}", to_markdown(bench.results));
  if (!ran) return ran.error();
  if (!written) return written.error();
  fmt::print("results in {}: report.html, tables.md, results.csv, results.json\n", bench.out.string());
  return exit_code(bench.results);
}

}  // namespace

Result<int> run_bench(const BenchSuite& suite, const FoundRecordings& found, const BenchOptions& options) {
  Bench bench{suite, found.recordings, {}, {}, options.out, options.quiet};
  for (const std::string& path : found.missing) {
    bench.results.remarks.push_back("Skipped, no such folder: " + path);
    if (!options.quiet) fmt::print(stderr, "semvslam: warning: skipped, no such folder: {}\n", path);
  }
  if (const Status status = make_folder(bench.out); !status) return status.error();
  if (const Status status = render_scenes(bench.recordings, bench.out, bench.quiet); !status) return status.error();
  bench.results.name = suite.name;
  bench.results.modes = modes_of(bench.recordings);
  bench.results.baseline = suite.baseline;
  bench.results.rpe_delta = suite.rpe_delta.text();
  bench.results.facts = facts_of(suite);
  for (const BenchRecording& recording : bench.recordings) {
    bench.results.sequences.push_back(recording.name);
    bench.truths.push_back(read_truth(recording.folder));
    if (const std::string& trouble = bench.truths.back().trouble; !trouble.empty())
      bench.results.remarks.push_back(fmt::format("{} has no score: {}", recording.name, trouble));
  }
  return execute(bench, options.again);
}

}  // namespace semvslam
