#pragma once

#include <string>

#include "semvslam/eval/bench_results.h"

namespace semvslam {

/// A row per run with every number, as RFC 4180 asks (lines end in LF).
std::string to_csv(const BenchResults& results);

/// Everything with full precision: settings, every run, median and range per sequence and mode.
std::string to_json(const BenchResults& results);

/// The tables of bench_tables() and what they were measured with.
std::string to_markdown(const BenchResults& results);

}  // namespace semvslam
