#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "semvslam/apps/bench_session.h"
#include "semvslam/apps/bench_suite.h"
#include "semvslam/apps/command.h"
#include "semvslam/base/foreign_text.h"
#include "semvslam/data/file_io.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

struct BenchArguments {
  std::vector<std::string> targets, assignments;
  std::string data, out, modes, baseline, camera, camera_preset;
  int runs = 0;                  // 0 = the suite's
  std::uint64_t max_frames = 0;  // 0 = the suite's
  bool deterministic = false, no_truth_masks = false, again = false, list = false, quiet = false;
};

/// A suite and what its relative paths start from.
struct ChosenSuite {
  BenchSuite suite;
  fs::path base;
};

int list_suites() {
  for (const BuiltInSuite& built_in : built_in_suites()) {
    const Result<BenchSuite> suite = built_in.read();
    if (!suite) continue;  // a test reads them all
    fmt::print("{:<10} {}; {} sequences, modes {}, {} {}\n", suite->name, suite->about, suite->entries.size(),
               fmt::join(suite->modes, ","), suite->runs, suite->runs == 1 ? "run" : "runs");
  }
  return kExitSuccess;
}

Error unknown_suite(const std::string& target) {
  std::vector<std::string_view> known;
  for (const BuiltInSuite& suite : built_in_suites()) known.push_back(suite.name);
  return {ErrorCode::kNotFound,
          fmt::format("{} is no suite ({}), no suite file and no folder", in_quotes(target), fmt::join(known, ", "))};
}

/// Folders of recordings as they were named; every one of them must be there.
Result<ChosenSuite> folders_as_suite(const std::vector<std::string>& targets) {
  std::error_code code;
  for (const std::string& target : targets) {
    if (fs::is_directory(target, code)) continue;
    if (targets.size() == 1) return unknown_suite(target);
    return Error{ErrorCode::kNotFound, fmt::format("{} is no folder of a recording", in_quotes(target))};
  }
  return ChosenSuite{suite_of_folders(targets), {}};
}

Result<ChosenSuite> choose_suite(const BenchArguments& a) {
  if (a.targets.size() != 1) return folders_as_suite(a.targets);
  const std::string& target = a.targets.front();
  for (const BuiltInSuite& built_in : built_in_suites())
    if (built_in.name == target) {
      Result<BenchSuite> suite = built_in.read();
      if (!suite) return suite.error();
      return ChosenSuite{std::move(*suite), a.data};
    }
  std::error_code code;
  if (!fs::is_regular_file(target, code)) return folders_as_suite(a.targets);
  const Result<std::string> text = read_text_file(target, 1 << 20);
  if (!text) return text.error();
  Result<BenchSuite> suite = parse_suite(*text, target, fs::path(target).stem().string());
  if (!suite) return suite.error();
  return ChosenSuite{std::move(*suite), a.data.empty() ? fs::path(target).parent_path() : fs::path(a.data)};
}

/// What the command line says wins over the suite.
Status apply_options(const BenchArguments& a, BenchSuite& suite) {
  if (!a.modes.empty()) {
    suite.modes = split_list(a.modes);
    for (SuiteEntry& entry : suite.entries) entry.modes.clear();
    const auto& modes = suite.modes;
    if (std::find(modes.begin(), modes.end(), suite.baseline) == modes.end()) suite.baseline.clear();
    choose_baseline(suite);
  }
  if (!a.baseline.empty()) suite.baseline = a.baseline;
  if (a.runs > 0) suite.runs = a.runs;
  if (a.max_frames > 0) suite.max_frames = a.max_frames;
  if (a.deterministic) suite.deterministic = true;
  if (a.no_truth_masks) suite.truth_masks = false;
  if (!a.camera.empty() || !a.camera_preset.empty())
    for (SuiteEntry& entry : suite.entries)
      if (!entry.scene) entry.camera = {a.camera.empty() ? "" : fs::absolute(a.camera).string(), a.camera_preset};
  suite.assignments.insert(suite.assignments.end(), a.assignments.begin(), a.assignments.end());
  return suite.check();
}

Result<int> bench(const BenchArguments& a) {
  if (a.list) return list_suites();
  Result<ChosenSuite> chosen = choose_suite(a);
  if (!chosen) return chosen.error();
  BenchSuite& suite = chosen->suite;
  if (const Status status = apply_options(a, suite); !status) return status.error();
  const FoundRecordings found = find_recordings(suite, chosen->base);
  if (found.recordings.empty())
    return Error{ErrorCode::kNotFound,
                 fmt::format("suite {}: none of its sequences is there ({}); --data names the folder they are in",
                             suite.name, fmt::join(found.missing, ", "))};
  BenchOptions options;
  options.out = a.out.empty() ? fs::path("bench_" + suite.name) : fs::path(a.out);
  options.again = a.again;
  options.quiet = a.quiet;
  return run_bench(suite, found, options);
}

}  // namespace

CommandHandler setup_bench(CLI::App& parser) {
  auto a = std::make_shared<BenchArguments>();
  parser.footer(
      "Every run is a process of its own, one at a time. Runs that are complete in the output folder, with the same\n"
      "arguments, program and recording, are not repeated. The exit code is 1 when a run failed or a limit is broken.");
  parser.add_option("SUITE", a->targets, "name of a suite (see --list), a suite file, or folders of recordings");
  parser.add_flag("--list", a->list, "show the suites that are built in");
  parser.add_option("--out", a->out, "folder for the results (bench_SUITE)");
  parser.add_option("--data", a->data, "folder that the suite's recordings are in; else the suite file's own");
  parser.add_option("--modes", a->modes, "modes to run, separated by commas");
  parser.add_option("--runs", a->runs, "of every sequence in every mode")->check(CLI::Range(1, 1000));
  parser.add_option("--baseline", a->baseline, "mode that improvements refer to (orb, where it is run)");
  parser.add_option("--set", a->assignments, "one configuration value for all runs, key=value; may be repeated")
      ->allow_extra_args(false);
  CLI::Option* camera = parser.add_option("--camera", a->camera, "camera YAML for all recordings");
  parser.add_option("--camera-preset", a->camera_preset, "built-in camera for all recordings, e.g. tum_fr3")
      ->excludes(camera);
  parser.add_option("--max-frames", a->max_frames, "stop every run after so many frames")
      ->check(CLI::Range(1, 1'000'000'000));
  parser.add_flag("--deterministic", a->deterministic, "deterministic runs");
  parser.add_flag("--no-truth-masks", a->no_truth_masks, "do not count features by true masks: it costs time");
  parser.add_flag("--again", a->again, "repeat runs that are complete");
  parser.add_flag("--quiet", a->quiet, "no progress on the terminal");
  parser.parse_complete_callback([a] {
    if (!a->list && a->targets.empty()) throw CLI::RequiredError("SUITE");
  });
  return [a] { return bench(*a); };
}

}  // namespace semvslam
