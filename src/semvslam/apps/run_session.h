#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/apps/run_output.h"
#include "semvslam/apps/run_statistics.h"
#include "semvslam/base/process_stats.h"
#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/data/sequence.h"
#include "semvslam/pipeline/config.h"

namespace semvslam {

/// Of this process, in seconds.
struct ProcessTime {
  double age_s = 0, cpu_s = 0;
  static ProcessTime now() { return {process_age_seconds(), process_cpu_seconds()}; }
};

struct RunOptions {
  std::filesystem::path out;
  std::optional<std::uint64_t> max_frames;
  bool quiet = false;
  std::filesystem::path debug_frames;     // folder for a picture per frame of what was taken for moving; empty = none
  std::filesystem::path key_frame_masks;  // folder for what moved in each key frame; empty = none
  std::filesystem::path truth_masks;      // folder of true masks to judge the policy by; empty = none
  std::vector<std::filesystem::path> dense_maps;  // files (see dense_format()) for a map of the key frames at the end
  std::filesystem::path map;                      // saved map to begin in; empty = none
  std::filesystem::path save_map;                 // file for the map at the end; empty = none
  ProcessTime before;  // spent on something else, as the demo on rendering: not counted to the run
};

/// How a run ended, and the results of the main sub-map; everything computed is in the output folder.
struct RunOutcome : SubMapResults {
  RunRecord record;
  SlamStatistics statistics;
  std::map<SubMapId, SubMapResults> apart;  // of the other sub-maps
  int signal = 0;                           // that ended it early; 0 = none
  Status status;                            // why it is not a success although results were written
};

/// Runs the system over all frames of `source` and writes the results. A frame that cannot be used is skipped, counted
/// and logged. An interrupt, a fatal error of the source or of the system ends the run early, with its results written;
/// so do no errors of the disk: the run goes on and what failed is tried again at its end.
/// @return an Error when nothing could be started: output folder, camera, saved map.
Result<RunOutcome> run_session(std::unique_ptr<FrameSource> source, Config& config, const RunOptions& options);

/// Runs the system over a recording, prints the summary and, where the recording has a ground truth, the score, which
/// is written to evaluation.json and evaluation.svg too. Of `sequence_options` the configuration decides on
/// want_colour.
/// @return the exit code of the program, or why the run is no success.
Result<int> run_recording(const std::filesystem::path& sequence, SequenceOptions sequence_options, Config& config,
                          const RunOptions& options);

}  // namespace semvslam
