#include "semvslam/eval/table.h"

#include <fmt/format.h>

#include <cmath>

#include "semvslam/eval/markup.h"

namespace semvslam {
namespace {

/// Markdown lets HTML through, and a bar would end the cell.
std::string markdown_cell(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '|')
      out += "\\|";
    else if (c == '<')
      out += "&lt;";
    else
      out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out;
}

template <typename Format>
std::string spread_text(const Spread& s, const Format& format) {
  if (s.count == 0) return "";
  const std::string middle = format(s.median), low = format(s.min), high = format(s.max);
  return low == high ? middle : fmt::format("{} ({}-{})", middle, low, high);
}

}  // namespace

std::string to_markdown(const Table& table) {
  std::string out = fmt::format("## {}\n\n", markdown_cell(table.title));
  for (const std::string& name : table.columns) out += fmt::format("| {} ", markdown_cell(name));
  out += "|\n";
  for (std::size_t i = 0; i < table.columns.size(); ++i) out += i < table.text_columns ? "|---" : "|---:";
  out += "|\n";
  for (const auto& row : table.rows) {
    for (const std::string& cell : row) out += fmt::format("| {} ", markdown_cell(cell));
    out += "|\n";
  }
  if (!table.note.empty()) out += fmt::format("\n{}\n", markdown_cell(table.note));
  return out + "\n";
}

std::string to_html(const Table& table) {
  std::string out = fmt::format("<h2>{}</h2>\n<div class=\"wide\"><table>\n<tr>", escape_markup(table.title));
  const auto kind = [&](std::size_t i) { return i < table.text_columns ? " class=\"text\"" : ""; };
  for (std::size_t i = 0; i < table.columns.size(); ++i)
    out += fmt::format("<th{}>{}</th>", kind(i), escape_markup(table.columns[i]));
  out += "</tr>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) out += fmt::format("<td{}>{}</td>", kind(i), escape_markup(row[i]));
    out += "</tr>\n";
  }
  out += "</table></div>\n";
  if (!table.note.empty()) out += fmt::format("<p class=\"note\">{}</p>\n", escape_markup(table.note));
  return out;
}

std::string three_digits(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  const int decimals = size >= 99.95                 ? 0
                       : size >= 9.995               ? 1
                       : size >= 0.0995 || size == 0 ? 2
                       : size >= 0.00995             ? 3
                                                     : 4;
  return fmt::format("{:.{}f}", value, decimals);
}

std::string format_spread(const Spread& spread, double scale) {
  return spread_text(spread, [&](double v) { return three_digits(v * scale); });
}

std::string format_counts(const Spread& spread) {
  return spread_text(spread, [](double v) { return fmt::format("{}", v); });
}

}  // namespace semvslam
