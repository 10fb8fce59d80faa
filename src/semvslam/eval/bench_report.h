#pragma once

#include <string>
#include <vector>

#include "semvslam/eval/bench_figures.h"
#include "semvslam/eval/bench_results.h"

namespace semvslam {

/// All tables and figures as one HTML page that needs no other file, no network and no script. Foreign text in it
/// (names of sequences, reasons of failures) is escaped.
std::string to_html(const BenchResults& results, const std::vector<DrawnSequence>& drawn);

}  // namespace semvslam
