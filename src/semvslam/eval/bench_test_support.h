#pragma once

#include <fmt/format.h>

#include <string>

#include "semvslam/eval/bench_results.h"

namespace semvslam::testing_support {

/// A run that ended well; every error statistic follows from the RMSE.
inline BenchRun bench_run(const std::string& sequence, const std::string& mode, int number, double ate_rmse_m) {
  BenchRun run;
  run.sequence = sequence;
  run.mode = mode;
  run.number = number;
  run.folder = fmt::format("runs/{}/{}/{}", sequence, mode, number);
  run.frames = 200;
  run.tracked = 200;
  run.tracking_mean_ms = 5;
  run.tracking_p95_ms = 8;
  run.frames_per_s = 60;
  run.cpu_ms_per_frame = 12;
  run.peak_memory_mb = 90;
  run.way_m = 2.5;
  const auto errors = [](double rmse) {
    return ErrorStatistics{200, rmse, rmse * 0.9, rmse * 0.8, rmse * 0.4, 0, 3 * rmse};
  };
  run.score = {errors(ate_rmse_m), errors(2 * ate_rmse_m), errors(10 * ate_rmse_m)};
  return run;
}

/// Two recordings, two modes; three runs of `full` on the first, one of which failed.
inline BenchResults small_bench() {
  BenchResults results;
  results.name = "small";
  results.sequences = {"walk", "rest"};
  results.modes = {"orb", "full"};
  results.baseline = "orb";
  results.facts = {{"processor", "A & B <fast>"}};
  results.runs = {bench_run("walk", "orb", 1, 0.4),    bench_run("walk", "full", 1, 0.006),
                  bench_run("walk", "full", 2, 0.005), bench_run("walk", "full", 3, 0.1),
                  bench_run("rest", "orb", 1, 0.0051), bench_run("rest", "full", 1, 0.0049)};
  results.runs[0].tracked = 150;
  results.runs[0].lost = 50;
  results.runs[1].truth = TruthShares{0.01, 0.002, 0.03, 0.004, 0.2};
  results.runs[3].failure = "exit code 3: it <b>broke</b>";
  results.runs[3].score.reset();
  return results;
}

}  // namespace semvslam::testing_support
