#pragma once

#include <filesystem>

#include "semvslam/apps/bench_suite.h"
#include "semvslam/base/result.h"

namespace semvslam {

struct BenchOptions {
  std::filesystem::path out;  // made where it is missing
  bool again = false;         // repeat runs that are complete
  bool quiet = false;
};

/// Renders what is missing, executes all runs, and writes results.json, results.csv, tables.md and report.html; prints
/// the tables, and a line per run on standard error. After an interrupt the same is written of what was done so far.
/// @return the exit code of the program: 1 when a run failed or a limit is broken. Errors: the output cannot be
/// written, a scene cannot be rendered.
Result<int> run_bench(const BenchSuite& suite, const FoundRecordings& found, const BenchOptions& options);

}  // namespace semvslam
