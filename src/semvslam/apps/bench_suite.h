#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/eval/bench_results.h"
#include "semvslam/eval/trajectory_error.h"
#include "semvslam/render/scene_source.h"

namespace semvslam {

/// A camera other than the recording's own: at most one of the two.
struct CameraChoice {
  std::string file;    // camera YAML
  std::string preset;  // a built-in camera's name
};

/// What a suite lists: recordings in folders, or a scene to be rendered.
struct SuiteEntry {
  std::string path;  // of a folder, or a pattern (* ? [..]) for several; empty for a scene
  std::optional<SceneOptions> scene;
  std::string name;                   // in tables; empty = the folder's, or people_motion
  std::vector<std::string> modes;     // empty = the suite's
  std::optional<BenchLimits> limits;  // absent = the suite's
  CameraChoice camera;                // of a recording
};

/// What `semvslam bench` runs. README, "Bench", shows the file that it is read from.
struct BenchSuite {
  std::string name, about;
  std::vector<SuiteEntry> entries;
  std::vector<std::string> modes = {"full"};
  std::string baseline;  // a mode; empty = none
  Delta rpe_delta;
  int runs = 1;
  std::uint64_t max_frames = 0;  // of each run; 0 = all
  bool deterministic = false;
  bool truth_masks = true;               // use the folder mask/ of a recording as true masks
  std::vector<std::string> assignments;  // "key=value" of the configuration
  BenchLimits limits;

  /// What single values cannot show: names, modes and configuration values that exist. The first fault.
  Status check() const;
};

/// Reads a suite from YAML. Where it names no baseline this is `orb` if it is one of the modes. Errors name file and
/// line: an unknown key (with the nearest known one), values out of range, an unknown mode, a scene that cannot be, an
/// entry that is neither folder nor scene, no sequence at all.
/// @param name where the text has none
Result<BenchSuite> parse_suite(const std::string& text, const std::string& origin, const std::string& name);

/// A suite for folders named on the command line: all modes `orb` and `full`.
BenchSuite suite_of_folders(const std::vector<std::string>& folders);

/// Makes `orb` the baseline where none is named and it is among the modes.
void choose_baseline(BenchSuite& suite);

/// A suite file that is part of the program (presets/bench in the sources).
struct BuiltInSuite {
  std::string_view name, text;
  Result<BenchSuite> read() const {
    return parse_suite(std::string(text), "suite " + std::string(name), std::string(name));
  }
};
std::span<const BuiltInSuite> built_in_suites();

/// A recording that a suite came down to. A scene's folder is empty until it is rendered.
struct BenchRecording {
  std::string name;  // unique, fit for a file
  std::filesystem::path folder;
  std::optional<SceneOptions> scene;
  std::vector<std::string> modes;
  BenchLimits limits;
  CameraChoice camera;
};

struct FoundRecordings {
  std::vector<BenchRecording> recordings;
  std::vector<std::string> missing;  // paths that are no folder, patterns that match none
};

/// Looks up the suite's folders. @param base what relative paths start from, of camera files too
FoundRecordings find_recordings(const BenchSuite& suite, const std::filesystem::path& base);

/// Whether a name can be a folder's: not empty, no slash, no control characters, neither "." nor "..", 100 bytes at
/// most.
bool is_plain_name(std::string_view name);

/// The parts of a text between commas, without empty ones.
std::vector<std::string> split_list(std::string_view text);

}  // namespace semvslam
