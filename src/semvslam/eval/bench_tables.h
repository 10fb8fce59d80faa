#pragma once

#include <vector>

#include "semvslam/eval/bench_results.h"
#include "semvslam/eval/table.h"

namespace semvslam {

/// A row per sequence and mode: what matters most.
Table summary_table(const BenchResults& results);

/// Everything as tables, the summary first: ATE, RPE (as Tables III to V of the paper), ATE across modes (VI), time per
/// frame (VII), features on moving things where true masks were there, published numbers where a recording is one of
/// the paper's, failed runs, broken limits. Tables that would be empty are left out.
std::vector<Table> bench_tables(const BenchResults& results);

}  // namespace semvslam
