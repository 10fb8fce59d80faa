#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "semvslam/apps/command.h"
#include "semvslam/apps/segmenter_options.h"
#include "semvslam/data/sequence.h"
#include "semvslam/semantic/folder_segmenter.h"
#include "semvslam/semantic/repair_experiment.h"
#include "semvslam/semantic/segmenter.h"

namespace semvslam {
namespace {

struct EvalRepairArguments {
  std::string sequence, masks, truth = "mask", json;
  std::vector<double> drops_percent{5, 10, 30, 50};
  std::vector<std::string> kinds{"frames", "instances", "limbs"}, settings;
  int seed = 1, run = 1, frames = 0;
  bool pose = false;
  RepairOptions repair;
  SegmenterOptions segmenter;
};

std::vector<RepairCase> cases_of(const EvalRepairArguments& a) {
  std::vector<RepairCase> out;
  for (const std::string& kind : a.kinds)
    for (const double percent : a.drops_percent)
      for (const char* mode : {"off", "paste", "carry"}) {
        RepairCase c;
        c.damage.kind = kind;
        c.damage.share = percent / 100;
        c.damage.run = a.run;
        c.damage.seed = a.seed;
        c.repair = a.repair;
        c.repair.mode = mode;
        out.push_back(c);
      }
  return out;
}

/// Camera motion from frame to frame out of the ground truth.
class TrueMotion {
 public:
  explicit TrueMotion(Trajectory poses) : poses_(std::move(poses)) {}

  std::optional<SE3> cur_from_prev(TimeStamp stamp) {
    constexpr std::int64_t kLargestGapNs = 10'000'000;
    while (at_ < poses_.size() && poses_[at_].stamp.ns < stamp.ns - kLargestGapNs) ++at_;
    std::optional<SE3> now;
    if (at_ < poses_.size() && poses_[at_].stamp.ns <= stamp.ns + kLargestGapNs) now = poses_[at_].world_from_camera;
    const std::optional<SE3> before = std::exchange(last_, now);
    if (!now || !before) return std::nullopt;
    return now->inverse() * *before;
  }

 private:
  Trajectory poses_;
  std::size_t at_ = 0;
  std::optional<SE3> last_;
};

std::string number(double value) { return value < 0 ? "-" : fmt::format("{:.4f}", value); }

void print_scores(const std::vector<RepairCase>& cases, const std::vector<RepairCaseScore>& scores) {
  fmt::print(
      "| lost | share | repair | recall | precision | recall, damaged | precision, damaged | lacks seen | false alarms "
      "| ms, damaged |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const RepairCaseScore& s = scores[i];
    fmt::print("| {} | {:.0f} % | {} | {} | {} | {} | {} | {} of {} | {} | {:.2f} |\n", cases[i].damage.kind,
               100 * cases[i].damage.share, cases[i].repair.mode, number(s.all.recall()), number(s.all.precision()),
               number(s.damaged.recall()), number(s.damaged.precision()), s.detected_frames, s.damaged_frames,
               s.false_alarms, s.damaged_time.median_ms);
  }
}

constexpr double kQuantiles[] = {0.5, 0.9, 0.95, 0.98, 0.99, 0.999};

void print_changes(const ChangeStatistics& changes, int history) {
  fmt::print(
      "\nChange of the number of person pixels, times the reference; all changes | losses only\n"
      "| k | 50 % | 90 % | 95 % | 98 % | 99 % | 99.9 % | 50 % | 90 % | 95 % | 98 % | 99 % | 99.9 % |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (int k = 1; k <= history; ++k) {
    fmt::print("| {} |", k);
    for (const bool losses : {false, true})
      for (const double q : kQuantiles) fmt::print(" {:.2f} |", changes.quantile(k, q, losses));
    fmt::print("\n");
  }
}

nlohmann::json as_json(const std::vector<RepairCase>& cases, const std::vector<RepairCaseScore>& scores,
                       const ChangeStatistics& changes, int history) {
  nlohmann::json out{{"cases", nlohmann::json::array()}, {"changes", nlohmann::json::array()}};
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const RepairCaseScore& s = scores[i];
    out["cases"].push_back({{"kind", cases[i].damage.kind},
                            {"share", cases[i].damage.share},
                            {"repair", cases[i].repair.mode},
                            {"frames", s.frames},
                            {"damaged_frames", s.damaged_frames},
                            {"detected_frames", s.detected_frames},
                            {"false_alarms", s.false_alarms},
                            {"recall", s.all.recall()},
                            {"precision", s.all.precision()},
                            {"damaged_recall", s.damaged.recall()},
                            {"damaged_precision", s.damaged.precision()},
                            {"restored_instances", s.restored_instances},
                            {"extended_instances", s.extended_instances},
                            {"ms_median", s.time.median_ms},
                            {"damaged_ms_median", s.damaged_time.median_ms},
                            {"damaged_ms_p95", s.damaged_time.p95_ms}});
  }
  for (int k = 1; k <= history; ++k)
    for (const bool losses : {false, true})
      for (const double q : kQuantiles)
        out["changes"].push_back({{"gap", k},
                                  {"losses_only", losses},
                                  {"quantile", q},
                                  {"times_reference", changes.quantile(k, q, losses)}});
  return out;
}

Result<std::unique_ptr<Segmenter>> masks_of(const EvalRepairArguments& a) {
  SegmenterOptions options = a.segmenter;
  if (a.masks != "network") {
    const Result<std::filesystem::path> folder = find_folder(a.sequence, a.masks);
    if (!folder) return folder.error();
    options.source = "folder";
    options.mask_folder = folder->string();
  }
  return make_segmenter(options, RoleTable());
}

Result<int> run_eval_repair(EvalRepairArguments a) {
  ConfigSchema schema;
  a.repair.add_to(schema);
  for (const std::string& assignment : a.settings)
    if (const Status s = schema.set(assignment); !s) return s.error();
  if (const Status s = a.repair.check(); !s) return s.error();
  SequenceOptions wanted;
  wanted.want_colour = a.masks == "network";
  const Result<std::unique_ptr<FrameSource>> source = open_sequence(a.sequence, wanted);
  if (!source) return source.error();
  const Result<std::unique_ptr<Segmenter>> given = masks_of(a);
  if (!given) return given.error();
  const Result<std::unique_ptr<FolderSegmenter>> truth =
      FolderSegmenter::open(std::filesystem::path(a.sequence) / a.truth, RoleTable());
  if (!truth) return truth.error();
  TrueMotion motion{{}};
  if (a.pose) {
    Result<Trajectory> poses = read_ground_truth(a.sequence);
    if (!poses) return poses.error();
    motion = TrueMotion(std::move(*poses));
  }
  RepairExperiment experiment((*source)->camera(), cases_of(a));
  ChangeStatistics changes(a.repair.quality);
  for (int n = 0; a.frames == 0 || n < a.frames; ++n) {
    const Result<std::optional<RgbdFrame>> read = (*source)->next();
    if (!read && (*source)->fatal()) return read.error();
    if (!read) continue;  // an unreadable frame is none of the experiment's
    if (!*read) break;
    const RgbdFrame& frame = **read;
    const cv::Mat& picture = wanted.want_colour ? frame.colour : frame.gray;
    const Result<Segmentation> masks = (*given)->segment({frame.id, frame.stamp, picture, ""});
    if (!masks) return masks.error();
    const Result<Segmentation> real = (*truth)->segment({frame.id, frame.stamp, frame.gray, ""});
    if (!real) return real.error();
    changes.add(frame.id, masks->pixels_of_class("person"));
    experiment.add(frame, *masks, real->mask_of_class("person"), motion.cur_from_prev(frame.stamp));
  }
  const std::vector<RepairCaseScore> scores = experiment.scores();
  const int history = a.repair.quality.history;
  if (a.json != "-") {
    print_scores(experiment.cases(), scores);
    print_changes(changes, history);
  }
  if (a.json.empty()) return static_cast<int>(kExitSuccess);
  if (const Status status = write_report(a.json, as_json(experiment.cases(), scores, changes, history).dump(1) + "\n");
      !status)
    return status.error();
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_eval_repair(CLI::App& parser) {
  constexpr int kMost = std::numeric_limits<int>::max();
  auto a = std::make_shared<EvalRepairArguments>();
  parser.add_option("SEQUENCE", a->sequence, "recording with true masks")->required();
  parser.add_option("--masks", a->masks, "masks to damage: a folder (also inside the recording), or `network`")
      ->default_val("mask");
  parser.add_option("--truth", a->truth, "folder of true masks inside the recording")->capture_default_str();
  parser.add_option("--drop", a->drops_percent, "percent that get lost, e.g. 5,10,30,50")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 100.0));
  parser.add_option("--kind", a->kinds, "what gets lost: frames, instances, limbs")
      ->delimiter(',')
      ->check(CLI::IsMember({"frames", "instances", "limbs"}));
  parser.add_option("--seed", a->seed, "of the damage")->capture_default_str()->check(CLI::Range(0, kMost));
  parser.add_option("--run", a->run, "so many frames in a row share their fate")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  parser.add_option("--frames", a->frames, "only the first so many frames (0 = all)")
      ->capture_default_str()
      ->check(CLI::Range(0, kMost));
  parser.add_flag("--pose", a->pose, "tell the repair the true camera motion");
  parser.add_option("--set", a->settings, "configuration value, e.g. repair.grow_px=0; repeatable");
  add_segmenter_options(parser, a->segmenter);
  parser.add_option("--json", a->json, "write all numbers to this file (- = standard output, alone)");
  return [a] { return run_eval_repair(*a); };
}

}  // namespace semvslam
