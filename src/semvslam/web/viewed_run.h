#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/eval/evaluation.h"
#include "semvslam/web/ply_reader.h"

namespace semvslam {

struct ViewOptions {
  std::filesystem::path dense;        // a cloud to show instead of the folder's dense.ply or map.ply
  std::filesystem::path truth;        // recording or trajectory file, instead of the one evaluation.json names
  std::size_t most_points = 200'000;  // of all runs together
  bool live = false;  // the run may be going on: it may have no pose yet and is not scored before its end
};

/// Points of a run's map, as many as are shown.
struct ViewedCloud {
  std::string what;               // "landmarks of map.ply"
  std::vector<PlyVertex> points;  // world
  bool has_colours = false;
  std::size_t in_file = 0, unusable = 0;  // unusable: see PointThinner
  double cell_m = 0;                      // one point was kept per cell of this size; 0 = all
};

/// What `semvslam run` wrote to a folder.
struct ViewedRun {
  std::string name;                   // the folder's
  Trajectory trajectory, key_frames;  // world from camera
  std::optional<Evaluation> evaluation;
  Trajectory truth;  // of the time of the trajectory, as in its file; empty without an evaluation
  ViewedCloud cloud;
  std::string statistics, evaluation_json;  // content of the files; empty = missing
  std::vector<std::string> remarks;         // what is missing or could not be used, one line each
};

/// Reads a run. All but trajectory.txt may be missing or damaged: that is a remark. Errors: no folder, no or an
/// unusable trajectory.txt (live: an unusable one), and whatever the options name themselves cannot be used.
Result<ViewedRun> read_run(const std::filesystem::path& folder, const ViewOptions& options);

/// Brings runs into one world where that can be: where each was scored, trajectories, key frames and clouds are moved
/// onto the ground truth. Else each stays in its own world, and the truths that there are are moved there.
/// @return whether all are in the world of the ground truth
bool bring_together(std::vector<ViewedRun>& runs);

}  // namespace semvslam
