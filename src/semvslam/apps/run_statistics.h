#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/apps/truth_masks.h"
#include "semvslam/pipeline/slam.h"

namespace semvslam {

/// What a run is, and how far it got, beside what the system itself counts.
struct RunRecord {
  std::string sequence, mode;  // `sequence`: description of the source
  bool deterministic = false, realtime = false;
  std::uint64_t read = 0;     // frames that the source gave
  std::uint64_t skipped = 0;  // frames that could not be used, each with a line in run.log
  std::uint64_t dropped = 0;  // frames left out to keep the camera's pace (realtime)
  double start_up_s = 0;      // from the start of the process, or of what belongs to the run, to the first frame
  double wall_s = 0;          // of the frames
  double cpu_s = 0;           // of the whole process, from there on
  std::int64_t peak_memory_bytes = 0;
  std::string map;                   // file of the saved map that it began in; "" = none
  double map_load_s = 0;             // reading it
  StageSummary input;                // waiting for frames
  std::optional<TruthCounts> truth;  // where true masks were given
  std::string end;                   // "complete", "running", or why it ended early
};

/// Content of stats.json.
std::string format_statistics(const RunRecord& run, const SlamStatistics& slam);
/// A line for each sub-map that is not in the results of the main one.
std::vector<std::string> format_apart(const SlamStatistics& slam);
/// Some lines for people.
std::string format_summary(const RunRecord& run, const SlamStatistics& slam);

}  // namespace semvslam
