#include "semvslam/web/run_facts.h"

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "semvslam/eval/table.h"

namespace semvslam {
namespace {

using Json = nlohmann::ordered_json;
using Path = std::initializer_list<const char*>;
using Words = std::pair<std::string_view, const char*>;

/// Names in the files, and what they mean to a reader.
constexpr Words kStageWords[] = {{"input", "waiting for a frame"},
                                 {"tracking", "tracking, all"},
                                 {"tracking.extract", "tracking: features"},
                                 {"tracking.dynamic", "tracking: what moves"},
                                 {"tracking.frame", "tracking: from the last frame"},
                                 {"tracking.local_map", "tracking: in the local map"},
                                 {"mapping", "mapping a key frame, all"},
                                 {"mapping.create", "mapping: new landmarks"},
                                 {"mapping.revisit", "mapping: drift at known places"},
                                 {"mapping.loop", "mapping: loops"},
                                 {"mapping.fuse", "mapping: fusing landmarks"},
                                 {"mapping.bundle", "mapping: bundle adjustment"},
                                 {"mapping.cull", "mapping: removing landmarks"},
                                 {"mapping.final_bundle", "bundle adjustment at the end"},
                                 {"segment", "finding people and things, all"},
                                 {"segment.prepare", "network: preparing the picture"},
                                 {"segment.trunk", "network: trunk"},
                                 {"segment.proposals", "network: proposals"},
                                 {"segment.boxes", "network: boxes"},
                                 {"segment.masks", "network: masks"}};
constexpr Words kReasonWords[] = {{"none", "nothing speaks against it"},
                                  {"no_evidence", "no test could be made"},
                                  {"near_moving", "beside something that moves, whose mask may lack it"},
                                  {"at_outline", "at the outline of something that moves"},
                                  {"point_motion", "its point is seen to move"},
                                  {"moving_region", "on an unknown thing that moves"},
                                  {"moving_instance", "on a known thing enough of whose points move"}};
constexpr Words kVerdictWords[] = {
    {"static", "static: used"}, {"unknown", "unknown: may find landmarks, makes none"}, {"moving", "moving: left out"}};
constexpr Words kMaskWords[] = {{"none", "no mask"},
                                {"given", "mask given with the frame"},
                                {"segmented", "mask of this very frame"},
                                {"propagated", "an earlier mask, carried on"}};
constexpr Words kStateWords[] = {{"qualified", "mask complete"},
                                 {"slight lack", "mask lacked a little, repaired"},
                                 {"serious lack", "mask lacked much, repaired"}};
constexpr Words kFailOpenWords[] = {{"motion", "too few features left: motion's verdicts given up"},
                                    {"semantic", "too few features left: masks given up"}};

std::string in_words(std::string_view name, std::span<const Words> words) {
  for (const auto& [known, meaning] : words)
    if (known == name) return meaning;
  return std::string(name);
}

/// The value at a path of keys; null where there is none.
const Json* find(const Json& json, Path path) {
  const Json* at = &json;
  for (const char* key : path) {
    if (!at->is_object()) return nullptr;
    const auto next = at->find(key);
    if (next == at->end()) return nullptr;
    at = &*next;
  }
  return at;
}

std::optional<double> number(const Json& json, Path path) {
  const Json* at = find(json, path);
  return at != nullptr && at->is_number() ? std::optional(at->get<double>()) : std::nullopt;
}

std::string text(const Json& json, Path path) {
  const Json* at = find(json, path);
  return at != nullptr && at->is_string() ? at->get<std::string>() : std::string();
}

Json parsed(std::string_view content) {
  Json json = Json::parse(content, nullptr, false);
  return json.is_object() ? json : Json::object();
}

std::string count_text(double count) { return fmt::format("{:.0f}", count); }
std::string percent_text(double share) { return fmt::format("{:.1f} %", 100 * share); }
std::string digits(std::optional<double> value, double scale = 1) {
  return value ? three_digits(scale * *value) : std::string("-");
}

Table two_columns(std::string title) { return {std::move(title), "", {"", ""}, 2, {}}; }

void add_row(Table& table, std::string name, std::string value) {
  if (!value.empty()) table.rows.push_back({std::move(name), std::move(value)});
}

void add_count(Table& table, const char* name, std::optional<double> count, bool also_zero) {
  if (count && (also_zero || *count > 0)) add_row(table, name, count_text(*count));
}

/// "598 of 600 (99.7 %)"
std::string tracked_text(const Json& s) {
  const auto tracked = number(s, {"tracked"}), frames = number(s, {"frames"});
  if (!tracked || !frames) return "";
  const double share = *frames > 0 ? *tracked / *frames : 0;
  return fmt::format("{:.0f} of {:.0f} ({})", *tracked, *frames, percent_text(share));
}

Table run_table(const Json& s) {
  Table table = two_columns("Run");
  add_row(table, "recording", text(s, {"sequence"}));
  add_row(table, "mode", text(s, {"mode"}));
  add_row(table, "state", text(s, {"end"}));
  add_row(table, "frames tracked", tracked_text(s));
  add_count(table, "lost", number(s, {"lost"}), true);
  add_count(table, "unusable frames skipped", number(s, {"skipped"}), false);
  add_count(table, "dropped to keep pace", number(s, {"dropped"}), false);
  add_count(table, "found again after a loss", number(s, {"relocalised"}), false);
  add_count(table, "key frames", number(s, {"key_frames"}), true);
  add_count(table, "landmarks", number(s, {"landmarks"}), true);
  add_count(table, "drift removed at known places", number(s, {"revisits"}), true);
  add_count(table, "loops closed", number(s, {"loops"}), true);
  add_row(table, "began in the saved map", text(s, {"saved_map", "file"}));
  return table;
}

Table accuracy_table(const Json& e) {
  Table table{"Accuracy", "", {"", "RMSE", "mean", "median", "max"}, 1, {}};
  const auto add = [&](const std::string& name, const char* key, double scale) {
    if (!number(e, {"estimate", key, "rmse"})) return;
    std::vector<std::string> row{name};
    for (const char* statistic : {"rmse", "mean", "median", "max"})
      row.push_back(digits(number(e, {"estimate", key, statistic}), scale));
    table.rows.push_back(std::move(row));
  };
  const std::string step = text(e, {"rpe_delta"});
  add("absolute error (ATE), mm", "ate_m", kMmPerM);
  add(fmt::format("drift over {} (RPE), mm", step), "rpe_translation_m", kMmPerM);
  add(fmt::format("drift over {} (RPE), degrees", step), "rpe_rotation_deg", 1);
  if (const auto share = number(e, {"estimate", "tracked_share"}))
    table.note =
        fmt::format("{} of the true poses have an estimate; aligned by {}. Ground truth: {}", percent_text(*share),
                    text(e, {"alignment"}) == "sim3" ? "Sim(3)" : "SE(3)", text(e, {"ground_truth", "file"}));
  return table;
}

std::string speed_text(const Json& s) {
  const auto part = [&](const char* key, const char* format) {
    const auto value = number(s, {key});
    return value ? fmt::format(fmt::runtime(format), *value) : std::string();
  };
  return part("frames_per_s", "{:.1f} frames/s. ") + part("wall_s", "{:.1f} s for the frames. ") +
         part("cpu_ms_per_frame", "Processor: {:.1f} ms a frame. ") + part("peak_memory_mb", "Memory: {:.0f} MB. ") +
         part("start_up_s", "Start-up: {:.2f} s.");
}

Table stage_table(const Json& s) {
  Table table{"Milliseconds per stage", speed_text(s), {"", "mean", "median", "95 %", "max", "times"}, 1, {}};
  const Json* stages = find(s, {"stages_ms"});
  if (stages == nullptr || !stages->is_object()) return table;
  for (const auto& [name, stage] : stages->items()) {
    std::vector<std::string> row{in_words(name, kStageWords)};
    for (const char* key : {"mean", "median", "p95", "max"}) row.push_back(digits(number(stage, {key})));
    const auto count = number(stage, {"count"});
    row.push_back(count ? count_text(*count) : "-");
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Counts of one kind with their share of the sum. Zeros are left out.
void add_shares(Table& table, const Json& s, Path path, std::span<const Words> words) {
  const Json* counts = find(s, path);
  if (counts == nullptr || !counts->is_object()) return;
  double sum = 0;
  for (const auto& [name, count] : counts->items())
    if (count.is_number()) sum += count.get<double>();
  for (const auto& [name, count] : counts->items())
    if (count.is_number() && count.get<double>() > 0)
      table.rows.push_back(
          {in_words(name, words), count_text(count.get<double>()), percent_text(count.get<double>() / sum)});
}

Table verdict_table(const Json& s) {
  Table table{"Features, and why some were left out", "", {"", "features", "share"}, 1, {}};
  add_shares(table, s, {"dynamic", "features"}, kVerdictWords);
  if (table.rows.empty()) return table;
  table.rows.push_back({"Reasons:", "", ""});
  add_shares(table, s, {"dynamic", "reasons"}, kReasonWords);
  return table;
}

Table mask_table(const Json& s) {
  Table table{"Masks of people and things", "", {"", "frames", "share"}, 1, {}};
  add_shares(table, s, {"dynamic", "mask_sources"}, kMaskWords);
  add_shares(table, s, {"dynamic", "segmentation_states"}, kStateWords);
  for (const auto& [name, meaning] : kFailOpenWords)
    if (const auto count = number(s, {"dynamic", "fail_open", name.data()}); count && *count > 0)
      table.rows.push_back({meaning, count_text(*count), ""});
  if (const auto share = number(s, {"dynamic", "masked_share"}))
    table.note = fmt::format("Masks covered {} of the picture. ", percent_text(*share));
  const auto add = [&](const char* key, const char* what) {
    if (const auto count = number(s, {"dynamic", key}); count && *count > 0)
      table.note += fmt::format("{:.0f} {}. ", *count, what);
  };
  add("restored_instances", "masks restored from an earlier frame");
  add("extended_instances", "masks extended");
  add("moving_regions", "sightings of unknown things that moved");
  add("moving_instances", "sightings of known things that moved");
  return table;
}

Table truth_mask_table(const Json& s) {
  Table table = two_columns("Against the true masks");
  const auto add = [&](const char* name, const char* key) {
    if (const auto share = number(s, {"truth", key})) add_row(table, name, percent_text(*share));
  };
  add("on moving things, of the features kept", "kept_on_moving");
  add("on moving things, of those the pose came from", "tracked_on_moving");
  add("static features dropped", "static_dropped");
  add("static features dropped clear of outlines", "clear_static_dropped");
  add("static features that may make no landmark", "static_barred");
  add("moving pixels that the masks cover", "pixel_recall");
  add("of the masks' pixels, moving", "pixel_precision");
  return table;
}

void check(std::string_view content, const char* name, std::vector<std::string>& remarks) {
  if (!content.empty() && !Json::parse(content, nullptr, false).is_object())
    remarks.push_back(fmt::format("{} is no JSON that could be understood: its numbers are not shown", name));
}

}  // namespace

RunFacts describe_run(std::string_view statistics, std::string_view evaluation) {
  RunFacts facts;
  check(statistics, "stats.json", facts.remarks);
  check(evaluation, "evaluation.json", facts.remarks);
  const Json s = parsed(statistics), e = parsed(evaluation);
  facts.is_running = text(s, {"end"}) == "running";
  for (Table& table : std::vector<Table>{run_table(s), accuracy_table(e), verdict_table(s), mask_table(s),
                                         truth_mask_table(s), stage_table(s)})
    if (!table.rows.empty()) facts.tables.push_back(std::move(table));
  if (const Json* notices = find(s, {"notices"}); notices != nullptr && notices->is_array())
    for (const Json& notice : *notices)
      if (notice.is_string()) facts.remarks.push_back(notice.get<std::string>());
  return facts;
}

Table compare_runs(const std::vector<std::string>& names, const std::vector<std::string>& statistics,
                   const std::vector<std::string>& evaluations) {
  Table table{
      "Comparison",
      "",
      {"run", "mode", "tracked", "ATE RMSE, mm", "RPE RMSE, mm", "RPE RMSE, degrees", "tracking, ms", "frames/s"},
      2,
      {}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Json s = parsed(statistics[i]), e = parsed(evaluations[i]);
    table.rows.push_back({names[i], text(s, {"mode"}), tracked_text(s),
                          digits(number(e, {"estimate", "ate_m", "rmse"}), kMmPerM),
                          digits(number(e, {"estimate", "rpe_translation_m", "rmse"}), kMmPerM),
                          digits(number(e, {"estimate", "rpe_rotation_deg", "rmse"})),
                          digits(number(s, {"stages_ms", "tracking", "mean"})), digits(number(s, {"frames_per_s"}))});
  }
  return table;
}

std::optional<std::string> named_ground_truth(std::string_view evaluation) {
  std::string name = text(parsed(evaluation), {"ground_truth", "file"});
  return name.empty() ? std::nullopt : std::optional(std::move(name));
}

}  // namespace semvslam
