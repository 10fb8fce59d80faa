#include "semvslam/apps/bench_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "semvslam/apps/child_process.h"
#include "semvslam/apps/interrupt.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/sequence.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/semantic/default_model.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kIdentityFile = "bench_run.json";
constexpr const char* kOutputFile = "output.log";
constexpr const char* kErrorPrefix = "semvslam: error: ";
constexpr std::size_t kMostLogBytes = 64 << 20;
/// What a run writes and nobody asks a bench for; the map is by far the largest.
constexpr const char* kNotKept[] = {"map.ply", "keyframes.txt", "evaluation.svg"};
/// What tells one recording from another under the same name, without reading its pictures.
constexpr const char* kRecordingFiles[] = {"rgb.txt", "depth.txt", "associations.txt", "groundtruth.txt",
                                           "camera.yaml"};

/// FNV-1a, 64 bits: tells files apart, is no protection against anybody.
class Fingerprint {
 public:
  void add(std::string_view bytes) {
    for (unsigned char c : bytes) value_ = (value_ ^ c) * 0x100000001b3U;
  }
  /// @return whether the file could be read; nothing is added else.
  bool add_file(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) return false;
    std::string part(1 << 20, '\0');
    while (file.read(part.data(), static_cast<std::streamsize>(part.size())) || file.gcount() > 0)
      add(std::string_view(part).substr(0, static_cast<std::size_t>(file.gcount())));
    return true;
  }
  std::string text() const { return fmt::format("{:016x}", value_); }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

bool has_true_masks(const fs::path& recording) {
  std::error_code code;
  for (fs::directory_iterator it(recording / "mask", code), end; !code && it != end; it.increment(code))
    if (it->path().extension() == ".png") return true;
  return false;
}

std::vector<std::string> arguments_of(const BenchSuite& suite, const BenchRecording& recording,
                                      const std::string& mode) {
  std::vector<std::string> out = {"run", fs::absolute(recording.folder).lexically_normal().string(), "--mode", mode,
                                  "--quiet"};
  if (!recording.camera.file.empty()) out.insert(out.end(), {"--camera", recording.camera.file});
  if (!recording.camera.preset.empty()) out.insert(out.end(), {"--camera-preset", recording.camera.preset});
  if (suite.deterministic) out.push_back("--deterministic");
  if (suite.max_frames > 0) out.insert(out.end(), {"--max-frames", std::to_string(suite.max_frames)});
  if (suite.truth_masks && has_true_masks(recording.folder)) out.insert(out.end(), {"--truth-masks", "mask"});
  for (const std::string& assignment : suite.assignments) out.insert(out.end(), {"--set", assignment});
  return out;
}

/// The program's own last word about what went wrong, where it had one.
std::string reason(const ChildEnd& end, const fs::path& log) {
  std::string out = end.text();
  const Result<std::string> text = read_text_file(log, kMostLogBytes);
  if (!text) return out;
  const auto begin = text->rfind(kErrorPrefix);
  if (begin == std::string::npos) return out;
  const auto from = begin + std::string_view(kErrorPrefix).size();
  return out + ": " + text->substr(from, text->find('\n', from) - from);
}

BenchRun run_of(const PlannedRun& plan, const BenchTruth& truth) {
  BenchRun run;
  run.sequence = plan.sequence;
  run.mode = plan.mode;
  run.number = plan.number;
  run.folder = plan.folder;
  run.way_m = truth.way_m;
  return run;
}

/// Reads what a run left. A failure to do so is the run's.
void read_numbers(const fs::path& folder, BenchRun& run) {
  const Result<std::string> text = read_text_file(folder / "stats.json", 1 << 20);
  Status status = text ? read_statistics(*text, run) : Status(text.error());
  if (!status) run.failure = status.error().message;
}

}  // namespace

std::vector<PlannedRun> plan_runs(const BenchSuite& suite, const std::vector<BenchRecording>& recordings) {
  std::vector<PlannedRun> plans;
  for (std::size_t i = 0; i < recordings.size(); ++i)
    for (int number = 1; number <= suite.runs; ++number)
      for (const std::string& mode : recordings[i].modes)
        plans.push_back({i, recordings[i].name, mode, number, arguments_of(suite, recordings[i], mode),
                         recordings[i].camera.file, fmt::format("runs/{}/{}/{}", recordings[i].name, mode, number)});
  return plans;
}

BenchTruth read_truth(const fs::path& recording) {
  BenchTruth out;
  Result<Trajectory> poses = read_ground_truth(recording);
  if (!poses) {
    if (poses.error().code != ErrorCode::kNotFound) out.trouble = poses.error().message;
    return out;
  }
  for (std::size_t i = 1; i < poses->size(); ++i)
    out.way_m += ((*poses)[i].world_from_camera.translation() - (*poses)[i - 1].world_from_camera.translation()).norm();
  out.poses = std::move(*poses);
  return out;
}

Result<BenchProgram> BenchProgram::self() {
  Fingerprint print;
  if (!print.add_file("/proc/self/exe"))
    return Error{ErrorCode::kIo, "/proc/self/exe: cannot be read: a bench starts this program again for every run"};
  // The network's description holds the check sums of its weights.
  if (const Result<fs::path> model = default_model_folder(); model) print.add_file(*model / "model.json");
  return BenchProgram{"/proc/self/exe", fmt::format("semvslam {} {}", SEMVSLAM_VERSION, print.text())};
}

BenchRunner::BenchRunner(BenchProgram program, fs::path out, bool again, EvaluationOptions scoring)
    : program_(std::move(program)), out_(std::move(out)), again_(again), scoring_(std::move(scoring)) {}

std::string BenchRunner::identity_of(const PlannedRun& plan, const fs::path& recording) const {
  Fingerprint print;
  for (const char* name : kRecordingFiles)
    if (print.add_file(recording / name)) print.add(name);
  if (!plan.camera_file.empty()) print.add_file(plan.camera_file);
  const Json json = {{"program", program_.identity}, {"arguments", plan.arguments}, {"recording", print.text()}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<BenchRunner::Outcome> BenchRunner::perform(const PlannedRun& plan, const fs::path& recording,
                                                  const BenchTruth& truth) {
  Outcome outcome{run_of(plan, truth), false, false, {}};
  const fs::path folder = out_ / plan.folder;
  const std::string identity = identity_of(plan, recording);
  if (const Result<std::string> before = read_text_file(folder / kIdentityFile, 1 << 20);
      !again_ && before && *before == identity) {
    read_numbers(folder, outcome.run);
    score(truth, outcome);
    outcome.kept = outcome.run.failure.empty();
    if (outcome.kept) return outcome;
    outcome.run = run_of(plan, truth);  // somebody took files away: once more
  }
  std::error_code code;
  fs::remove_all(folder, code);  // what cannot be removed shows when the folder is written to
  if (const Status status = make_folder(folder); !status) return status.error();
  std::vector<std::string> arguments = plan.arguments;
  arguments.insert(arguments.end(), {"--out", fs::absolute(folder).string()});
  const Result<ChildEnd> end = run_child(program_.path, arguments, folder / kOutputFile);
  outcome.interrupted = InterruptGuard::received() != 0 && (!end || !end->good());
  if (outcome.interrupted) return outcome;
  if (!end || !end->good()) {
    outcome.run.failure = end ? reason(*end, folder / kOutputFile) : end.error().message;
    return outcome;
  }
  for (const char* name : kNotKept) fs::remove(folder / name, code);
  read_numbers(folder, outcome.run);
  score(truth, outcome);
  if (!outcome.run.failure.empty()) return outcome;
  if (const Status status = write_file_atomically(folder / kIdentityFile, identity); !status) return status.error();
  return outcome;
}

Result<Evaluation> BenchRunner::evaluate_run(const BenchRun& run, const BenchTruth& truth) const {
  if (!truth.poses) return Error{ErrorCode::kNotFound, run.sequence + ": has no true poses"};
  const Result<Trajectory> trajectory = read_trajectory(out_ / run.folder / "trajectory.txt");
  if (!trajectory) return trajectory.error();
  return evaluate(*truth.poses, *trajectory, scoring_);
}

void BenchRunner::score(const BenchTruth& truth, Outcome& outcome) const {
  if (!outcome.run.failure.empty() || !truth.poses) return;
  const Result<Evaluation> e = evaluate_run(outcome.run, truth);
  if (e)
    outcome.run.score = {e->absolute.statistics_m, e->relative.translation_m, e->relative.rotation_deg};
  else
    outcome.no_score = e.error().message;
}

Status read_statistics(const std::string& text, BenchRun& run) {
  try {
    const Json json = Json::parse(text);
    if (const std::string end = json.at("end"); end != "complete")
      return Error{ErrorCode::kInvalidInput, fmt::format("stats.json: the run is not complete: {}", end)};
    run.frames = json.at("frames");
    run.tracked = json.at("tracked");
    run.lost = json.at("lost");
    run.skipped = json.at("skipped");
    const Json& tracking = json.at("stages_ms").at("tracking");
    run.tracking_mean_ms = tracking.at("mean");
    run.tracking_p95_ms = tracking.at("p95");
    run.frames_per_s = json.at("frames_per_s");
    run.cpu_ms_per_frame = json.at("cpu_ms_per_frame");
    run.peak_memory_mb = json.at("peak_memory_mb");
    run.start_up_s = json.at("start_up_s");
    run.wall_s = json.at("wall_s");
    if (const auto truth = json.find("truth"); truth != json.end() && truth->at("frames") > 0)
      run.truth = TruthShares{truth->at("kept_on_moving"), truth->at("tracked_on_moving"), truth->at("static_dropped"),
                              truth->at("clear_static_dropped"), truth->at("static_barred")};
    return Status::success();
  } catch (const Json::exception& e) {
    return Error{ErrorCode::kInvalidInput, fmt::format("stats.json is not what 'semvslam run' writes: {}", e.what())};
  }
}

}  // namespace semvslam
