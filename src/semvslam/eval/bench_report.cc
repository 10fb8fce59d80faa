#include "semvslam/eval/bench_report.h"

#include <fmt/format.h>

#include "semvslam/eval/bench_tables.h"
#include "semvslam/eval/markup.h"
#include "semvslam/eval/svg_chart.h"

namespace semvslam {
namespace {

constexpr const char* kStyle = R"css(
body{font:15px/1.45 "DejaVu Sans",Helvetica,Arial,sans-serif;color:#222;max-width:1400px;margin:24px auto;padding:0 20px}
h1{font-size:26px;margin:0 0 12px}h2{font-size:19px;margin:34px 0 8px}h3{font-size:16px;margin:26px 0 4px}
table{border-collapse:collapse;font-size:13px}td,th{padding:3px 10px;text-align:right;border-bottom:1px solid #e2e2e2;vertical-align:top}
th{border-bottom:1px solid #777;vertical-align:bottom}.text{text-align:left}.wide{overflow-x:auto}
td:not(.text){white-space:nowrap}.row{display:flex;flex-wrap:wrap}
.note{color:#555;font-size:13px;max-width:900px;margin:6px 0}.bad{color:#a31515;font-weight:bold}
.legend span{margin-right:20px;white-space:nowrap}.legend i{display:inline-block;width:26px;height:0;border-top:3px solid;margin-right:7px;vertical-align:middle}
.legend i.dashed{border-top-style:dashed}svg{display:block}
)css";

std::string legend_entry(const std::string& label, const std::string& colour, bool dashed = false) {
  return fmt::format("<span><i{} style=\"border-color:{}\"></i>{}</span>", dashed ? " class=\"dashed\"" : "", colour,
                     escape_markup(label));
}

std::string legend_of(const std::vector<std::string>& modes) {
  std::string out;
  for (const std::string& mode : modes) out += legend_entry(mode, mode_colour(mode));
  return out;
}

std::string facts_table(const BenchResults& results) {
  std::string out = "<table>\n";
  for (const auto& [name, value] : results.facts)
    out += fmt::format("<tr><td class=\"text\">{}</td><td class=\"text\">{}</td></tr>\n", escape_markup(name),
                       escape_markup(value));
  return out + "</table>\n";
}

std::string remarks(const BenchResults& results) {
  std::string out;
  for (const std::string& remark : results.remarks)
    out += fmt::format("<p class=\"note\">{}</p>\n", escape_markup(remark));
  std::size_t failed = 0;
  for (const BenchRun& run : results.runs) failed += !run.failure.empty();
  if (failed > 0) out += fmt::format("<p class=\"bad\">Failed runs: {} of {}</p>\n", failed, results.runs.size());
  if (!results.broken_limits.empty())
    out += fmt::format("<p class=\"bad\">Broken limits: {}</p>\n", results.broken_limits.size());
  return out;
}

std::string bar_figures(const BenchResults& results) {
  const std::vector<std::string> figures = draw_error_bars(results);
  if (figures.empty()) return {};
  std::string out = "<h2>Errors by sequence and mode (as the paper's Figures 11 to 13 and 18)</h2>\n";
  out += "<p class=\"legend\">" + legend_of(results.modes);
  for (const DrawnSystem& system : drawn_systems(results)) out += legend_entry(std::string(system.name), system.colour);
  out += "</p>\n<div class=\"row\">\n";
  for (const std::string& svg : figures) out += "<div class=\"wide\">" + svg + "</div>\n";
  return out + "</div>\n";
}

std::string sequence_figures(const DrawnSequence& drawn) {
  std::vector<std::string> modes;
  std::string numbers;
  for (const DrawnRun& run : drawn.runs) {
    modes.push_back(run.mode);
    numbers += fmt::format("{}{}: run {}, {:.1f} % of the frames that have a true pose tracked",
                           numbers.empty() ? "" : "; ", run.mode, run.number, 100 * run.evaluation.tracked_share);
  }
  const std::string legend = legend_entry("ground truth", kTruthColour, true) +
                             legend_entry("difference at equal times", kDrawnDifferenceColour) + legend_of(modes);
  return fmt::format(
      "<h3>{}</h3>\n<p class=\"legend\">{}</p>\n<div class=\"wide\">{}</div>\n<div class=\"wide\">{}</div>\n"
      "<p class=\"note\">{}</p>\n",
      escape_markup(drawn.sequence), legend, draw_trajectories(drawn), draw_errors_over_time(drawn),
      escape_markup(numbers));
}

}  // namespace

std::string to_html(const BenchResults& results, const std::vector<DrawnSequence>& drawn) {
  const std::string title = escape_markup("Bench " + results.name);
  // The policy keeps the promise of the page even if something foreign should slip through.
  std::string out = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<h1>{}</h1>\n",
      title, kStyle, title);
  out += facts_table(results) + remarks(results);
  for (const Table& table : bench_tables(results)) out += to_html(table);
  out += bar_figures(results);
  if (!drawn.empty()) out += "<h2>Trajectories and errors over time (as the paper's Figures 14 to 17)</h2>\n";
  for (const DrawnSequence& sequence : drawn)
    if (!sequence.runs.empty()) out += sequence_figures(sequence);
  return out + "</body>\n</html>\n";
}

}  // namespace semvslam
