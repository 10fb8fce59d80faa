#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/eval/table.h"

namespace semvslam {

/// What stats.json and evaluation.json say, in plain words. Whatever they lack is left out; files that are no JSON or
/// hold something else give no table and a remark.
struct RunFacts {
  std::vector<Table> tables;
  std::vector<std::string> remarks;  // the run's own notices, and what of the files cannot be understood
  bool is_running = false;           // or was killed
};

/// @param statistics, evaluation content of the two files; empty = there is none
RunFacts describe_run(std::string_view statistics, std::string_view evaluation);

/// One line per run: mode, tracked, errors, speed. @param names, statistics, evaluations of equal length
Table compare_runs(const std::vector<std::string>& names, const std::vector<std::string>& statistics,
                   const std::vector<std::string>& evaluations);

/// The recording or file that evaluation.json was made with; nothing where it names none.
std::optional<std::string> named_ground_truth(std::string_view evaluation);

}  // namespace semvslam
