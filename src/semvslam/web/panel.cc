#include "semvslam/web/panel.h"

#include <fmt/format.h>

#include "semvslam/eval/markup.h"
#include "semvslam/eval/table.h"
#include "semvslam/web/run_facts.h"

namespace semvslam {
namespace {

std::string cloud_text(const ViewedCloud& cloud) {
  if (cloud.what.empty()) return "";
  std::string out =
      fmt::format("Points: {}, {} of {} shown", escape_markup(cloud.what), cloud.points.size(), cloud.in_file);
  if (cloud.unusable > 0) out += fmt::format(", {} lie nowhere or too far away", cloud.unusable);
  if (cloud.cell_m > 0) out += fmt::format(", one per {} mm", three_digits(1e3 * cloud.cell_m));
  return fmt::format("<p class=\"note\">{}.</p>\n", out);
}

std::string part_of(const ViewedRun& run) {
  std::string out;
  for (const std::string& remark : run.remarks)
    out += fmt::format("<p class=\"remark\">{}</p>\n", escape_markup(remark));
  out += cloud_text(run.cloud);
  for (const Table& table : describe_run(run.statistics, run.evaluation_json).tables) out += to_html(table);
  return out;
}

Table comparison(const std::vector<ViewedRun>& runs) {
  std::vector<std::string> names, statistics, evaluations;
  for (const ViewedRun& run : runs) {
    names.push_back(run.name);
    statistics.push_back(run.statistics);
    evaluations.push_back(run.evaluation_json);
  }
  return compare_runs(names, statistics, evaluations);
}

}  // namespace

std::string format_panel(const std::vector<ViewedRun>& runs) {
  if (runs.size() == 1) return part_of(runs.front());
  std::string out = to_html(comparison(runs));
  for (const ViewedRun& run : runs)
    out += fmt::format("<details><summary>{}</summary>\n{}</details>\n", escape_markup(run.name), part_of(run));
  return out;
}

}  // namespace semvslam
