#include "semvslam/eval/bench_tables.h"

#include <fmt/format.h>

#include <cmath>

#include "semvslam/eval/published.h"

namespace semvslam {
namespace {

constexpr double kToPercent = 100;
constexpr const char* kOthers = "published, other machine";
constexpr const char* kSources =
    " Published: the Sem-VSLAM paper, Tables VI and VII, which takes the errors from the systems' own papers; NGD-SLAM "
    "from "
    "its own.";

std::string percent(const Spread& share) {
  return share.count == 0 ? "" : fmt::format("{:.1f}", kToPercent * share.median);
}

/// The share tracked, of the median run; of the least one too where that differs.
std::string tracked(const BenchCell& cell) {
  const Spread share = cell.over("tracked_share");
  const std::string median = percent(share), least = fmt::format("{:.1f}", kToPercent * share.min);
  return share.count == 0 || median == least ? median : fmt::format("{} (least {})", median, least);
}

/// The four statistics of one kind of error, by the names of bench_number().
struct ErrorKind {
  const char *title, *rmse, *mean, *median, *sd;
  double scale;
};

std::string improvement(const BenchCell& cell, const BenchCell* baseline, const char* name) {
  if (baseline == nullptr || baseline->mode == cell.mode) return "";
  const Spread ours = cell.over(name), other = baseline->over(name);
  if (ours.count == 0 || other.count == 0) return "";
  const double gain = improvement_percent(other.median, ours.median);
  return std::isfinite(gain) ? fmt::format("{:.2f}", gain) : "-";
}

Table error_table(const BenchResults& results, const std::vector<BenchCell>& cells, const ErrorKind& kind) {
  Table table;
  table.title = kind.title;
  table.text_columns = 2;
  table.columns = {"sequence", "mode", "RMSE", "mean", "median", "SD", "tracked, %"};
  const bool gains = !results.baseline.empty() && results.modes.size() > 1;
  if (gains) table.columns.insert(table.columns.end(), {"improvement RMSE, %", "improvement SD, %"});
  for (const BenchCell& cell : cells) {
    if (cell.over(kind.rmse).count == 0) continue;
    const auto median = [&](const char* name) { return three_digits(kind.scale * cell.over(name).median); };
    table.rows.push_back({cell.sequence, cell.mode, median(kind.rmse), median(kind.mean), median(kind.median),
                          median(kind.sd), tracked(cell)});
    if (!gains) continue;
    const BenchCell* baseline = find_cell(cells, cell.sequence, results.baseline);
    table.rows.back().push_back(improvement(cell, baseline, kind.rmse));
    table.rows.back().push_back(improvement(cell, baseline, kind.sd));
  }
  table.note = "Medians over the runs.";
  if (gains)
    table.note += fmt::format(" Improvement over the mode {}: ({} - ours) / {} x 100.", results.baseline,
                              results.baseline, results.baseline);
  return table;
}

std::vector<Table> error_tables(const BenchResults& results, const std::vector<BenchCell>& cells) {
  const std::string translation =
      fmt::format("Relative pose error over {}, translation, mm (as the paper's Table IV)", results.rpe_delta);
  const std::string rotation =
      fmt::format("Relative pose error over {}, rotation, degrees (as the paper's Table V)", results.rpe_delta);
  const ErrorKind kinds[] = {{"Absolute trajectory error, mm (as the paper's Table III)", "ate_rmse_m", "ate_mean_m",
                              "ate_median_m", "ate_sd_m", kMmPerM},
                             {translation.c_str(), "rpe_translation_rmse_m", "rpe_translation_mean_m",
                              "rpe_translation_median_m", "rpe_translation_sd_m", kMmPerM},
                             {rotation.c_str(), "rpe_rotation_rmse_deg", "rpe_rotation_mean_deg",
                              "rpe_rotation_median_deg", "rpe_rotation_sd_deg", 1}};
  std::vector<Table> out;
  for (const ErrorKind& kind : kinds) out.push_back(error_table(results, cells, kind));
  // How far that is of the way is only told of absolute errors.
  Table& absolute = out.front();
  absolute.columns.insert(absolute.columns.end(), {"way, m", "RMSE of the way, %"});
  for (auto& row : absolute.rows) {
    const BenchCell* cell = find_cell(cells, row[0], row[1]);
    row.push_back(three_digits(cell->over("way_m").median));
    row.push_back(fmt::format("{:.2f}", kToPercent * cell->over("ate_share_of_way").median));
  }
  return out;
}

std::string across_cell(const BenchCell* cell) {
  if (cell == nullptr || cell->over("ate_rmse_m").count == 0) return "";
  const double share = cell->over("tracked_share").median;
  const std::string error = three_digits(kMmPerM * cell->over("ate_rmse_m").median);
  return share > 0.9995 ? error : fmt::format("{} [{:.1f} %]", error, kToPercent * share);
}

bool has_paper_sequence(const BenchResults& results) {
  for (const std::string& sequence : results.sequences)
    if (paper_sequence(sequence)) return true;
  return false;
}

void add_published_errors(const BenchResults& results, Table& table) {
  for (const PublishedSystem& system : published_systems()) {
    std::vector<std::string> row = {std::string(system.system), kOthers};
    bool any = false;
    for (const std::string& sequence : results.sequences) {
      const auto error = system.ate_rmse_m(sequence);
      row.push_back(error ? three_digits(kMmPerM * *error) : "");
      any = any || error;
    }
    if (any) table.rows.push_back(std::move(row));
  }
  if (has_paper_sequence(results)) table.note += kSources;
}

Table across_table(const BenchResults& results, const std::vector<BenchCell>& cells) {
  Table table;
  table.title = "ATE RMSE across modes and systems, mm (as the paper's Table VI)";
  table.note =
      "Ours: medians over the runs, of all frames; where fewer were tracked their share stands behind the error.";
  table.text_columns = 2;
  table.columns = {"system", "source"};
  table.columns.insert(table.columns.end(), results.sequences.begin(), results.sequences.end());
  for (const std::string& mode : results.modes) {
    std::vector<std::string> row = {"semvslam, " + mode, "this machine"};
    bool any = false;
    for (const std::string& sequence : results.sequences) {
      row.push_back(across_cell(find_cell(cells, sequence, mode)));
      any = any || !row.back().empty();
    }
    if (any) table.rows.push_back(std::move(row));
  }
  add_published_errors(results, table);
  return table;
}

/// The middle and the ends of the medians of a mode's sequences.
Spread over_sequences(const std::vector<BenchCell>& cells, const std::string& mode, const char* name) {
  std::vector<double> values;
  for (const BenchCell& cell : cells)
    if (const Spread s = cell.over(name); cell.mode == mode && s.count > 0) values.push_back(s.median);
  return spread_of(values);
}

Table time_table(const BenchResults& results, const std::vector<BenchCell>& cells) {
  Table table;
  table.title = "Time per frame (as the paper's Table VII)";
  table.note =
      "Ours: of the sequences' medians the median and the range. Tracking is the time from a frame to its pose; the "
      "network, mapping and decoding run beside it.";
  table.text_columns = 3;
  table.columns = {"system",  "source", "hardware", "tracking, mean ms", "tracking, p95 ms", "processor time, ms",
                   "frames/s"};
  std::string processor;
  for (const auto& [name, value] : results.facts)
    if (name == "processor") processor = value;
  for (const std::string& mode : results.modes) {
    if (over_sequences(cells, mode, "tracking_mean_ms").count == 0) continue;
    std::vector<std::string> row = {"semvslam, " + mode, "this machine", processor};
    for (const char* name : {"tracking_mean_ms", "tracking_p95_ms", "cpu_ms_per_frame", "frames_per_s"})
      row.push_back(format_spread(over_sequences(cells, mode, name)));
    table.rows.push_back(std::move(row));
  }
  if (!has_paper_sequence(results)) return table;
  table.note += kSources;
  for (const PublishedSystem& s : published_systems())
    if (!s.tracking_ms.empty())
      table.rows.push_back(
          {std::string(s.system), kOthers, std::string(s.hardware), std::string(s.tracking_ms), "", "", ""});
  return table;
}

Table truth_table(const std::vector<BenchCell>& cells) {
  Table table;
  table.title = "Features on moving things and on the static scene, %";
  table.note =
      "Against the sequences' true masks, medians over the runs. Kept: of the features that a landmark may come from "
      "or "
      "was found at, those on moving things. Tracked: of those that the pose came from. Dropped: of the static scene's "
      "features those that tracking may not use; clear of outlines: the same where nothing that moves is near. Barred: "
      "of the others on the static scene those that found no landmark and may not make one.";
  table.text_columns = 2;
  table.columns = {"sequence",
                   "mode",
                   "on moving things, of the kept",
                   "of the tracked",
                   "static dropped",
                   "static dropped, clear of outlines",
                   "static barred from the map"};
  for (const BenchCell& cell : cells) {
    if (cell.over("kept_on_moving").count == 0) continue;
    table.rows.push_back({cell.sequence, cell.mode});
    for (const char* name :
         {"kept_on_moving", "tracked_on_moving", "static_dropped", "clear_static_dropped", "static_barred"})
      table.rows.back().push_back(percent(cell.over(name)));
  }
  return table;
}

Table published_relative_table(const BenchResults& results) {
  Table table;
  table.title = "Relative pose error, published, other machine";
  table.note = "From the Sem-VSLAM paper, Tables IV and V; it does not say over which step.";
  table.text_columns = 2;
  table.columns = {"sequence", "system", "translation RMSE, mm", "SD, mm", "rotation RMSE, degrees", "SD, degrees"};
  for (const std::string& sequence : results.sequences)
    if (const auto known = paper_sequence(sequence))
      for (const PublishedRelativeError& p : published_relative_errors()) {
        const auto& v = p.values.at(static_cast<std::size_t>(*known));
        table.rows.push_back({sequence, std::string(p.system), three_digits(kMmPerM * v.translation_rmse_m),
                              three_digits(kMmPerM * v.translation_sd_m), three_digits(v.rotation_rmse_deg),
                              three_digits(v.rotation_sd_deg)});
      }
  return table;
}

Table failure_table(const BenchResults& results) {
  Table table;
  table.title = "Failed runs";
  table.text_columns = 4;
  table.columns = {"sequence", "mode", "run", "why"};
  for (const BenchRun& run : results.runs)
    if (!run.failure.empty()) table.rows.push_back({run.sequence, run.mode, std::to_string(run.number), run.failure});
  return table;
}

Table limits_table(const BenchResults& results) {
  Table table;
  table.title = "Broken limits";
  table.columns = {"what"};
  for (const std::string& line : results.broken_limits) table.rows.push_back({line});
  return table;
}

}  // namespace

Table summary_table(const BenchResults& results) {
  Table table;
  table.title = "Summary";
  table.note = "Median (range) over the runs that did not fail.";
  table.text_columns = 2;
  table.columns = {"sequence", "mode",         "runs",    "failed",   "ATE RMSE, mm",        "tracked, %",
                   "lost",     "tracking, ms", "p95, ms", "frames/s", "processor, ms/frame", "memory, MB"};
  for (const BenchCell& cell : cells_of(results)) {
    const auto spread = [&](const char* name, double scale = 1) { return format_spread(cell.over(name), scale); };
    table.rows.push_back({cell.sequence, cell.mode, std::to_string(cell.good.size() + cell.failed.size()),
                          std::to_string(cell.failed.size()), spread("ate_rmse_m", kMmPerM), tracked(cell),
                          format_counts(cell.over("lost")), spread("tracking_mean_ms"), spread("tracking_p95_ms"),
                          spread("frames_per_s"), spread("cpu_ms_per_frame"), spread("peak_memory_mb")});
  }
  return table;
}

std::vector<Table> bench_tables(const BenchResults& results) {
  const std::vector<BenchCell> cells = cells_of(results);
  std::vector<Table> all = {summary_table(results)};
  for (Table& table : error_tables(results, cells)) all.push_back(std::move(table));
  all.push_back(across_table(results, cells));
  all.push_back(time_table(results, cells));
  all.push_back(truth_table(cells));
  all.push_back(published_relative_table(results));
  all.push_back(failure_table(results));
  all.push_back(limits_table(results));
  std::erase_if(all, [](const Table& table) { return table.rows.empty(); });
  return all;
}

}  // namespace semvslam
