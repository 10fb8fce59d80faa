#include "semvslam/eval/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace semvslam {
namespace {

constexpr double kLeftMargin = 62, kRightMargin = 14, kTopMargin = 28, kBottomMargin = 46;
constexpr double kMinPixelStep = 0.4;  // nearer points than this are not drawn: files stay small

struct Interval {
  double low = 0, high = 1;
  double size() const { return high - low; }
  double middle() const { return 0.5 * (low + high); }
};

Interval extent(const std::vector<ChartSeries>& series, std::vector<double> ChartSeries::*values) {
  Interval out{INFINITY, -INFINITY};
  for (const ChartSeries& s : series)
    for (double v : s.*values)
      if (std::isfinite(v)) out = {std::min(out.low, v), std::max(out.high, v)};
  if (!(out.low <= out.high)) return {0, 1};
  if (out.size() < 1e-9) return {out.low - 0.5e-3, out.high + 0.5e-3};
  return out;
}

Interval padded(const Interval& i, double share) { return {i.low - share * i.size(), i.high + share * i.size()}; }

/// The inner box in pixels and the part of the data's plane that it shows.
struct Frame {
  double left, top, width, height;
  Interval x, y;
  double px(double v) const { return left + (v - x.low) / x.size() * width; }
  double py(double v) const { return top + (y.high - v) / y.size() * height; }
};

Frame frame_of(const Chart& c) {
  Frame f{c.left_px + kLeftMargin,
          c.top_px + kTopMargin,
          c.width_px - kLeftMargin - kRightMargin,
          c.height_px - kTopMargin - kBottomMargin,
          padded(extent(c.series, &ChartSeries::x), c.equal_aspect ? 0.05 : 0),
          padded(extent(c.series, &ChartSeries::y), 0.05)};
  if (c.y_from_zero) f.y.low = 0;
  if (c.equal_aspect) {
    const double unit = std::max(f.x.size() / f.width, f.y.size() / f.height);  // data per pixel
    f.x = {f.x.middle() - 0.5 * unit * f.width, f.x.middle() + 0.5 * unit * f.width};
    f.y = {f.y.middle() - 0.5 * unit * f.height, f.y.middle() + 0.5 * unit * f.height};
  }
  return f;
}

std::string number(double v, double step) {
  if (std::abs(v) < 1e-9 * step) v = 0;
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  return fmt::format("{:.{}f}", v, decimals);
}

void draw_axes(const Chart& c, const Frame& f, fmt::memory_buffer& out) {
  const auto to = std::back_inserter(out);
  const auto step = [](const std::vector<double>& t) { return t.size() > 1 ? t[1] - t[0] : 1.0; };
  const std::vector<double> xs = tick_positions(f.x.low, f.x.high, static_cast<int>(f.width / 80));
  const std::vector<double> ys = tick_positions(f.y.low, f.y.high, static_cast<int>(f.height / 45));
  for (double v : xs)
    fmt::format_to(to,
                   "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{0:.1f}\" y2=\"{2:.1f}\" class=\"grid\"/>"
                   "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4}</text>\n",
                   f.px(v), f.top, f.top + f.height, f.top + f.height + 17, number(v, step(xs)));
  for (double v : ys)
    fmt::format_to(to,
                   "<line x1=\"{1:.1f}\" y1=\"{0:.1f}\" x2=\"{2:.1f}\" y2=\"{0:.1f}\" class=\"grid\"/>"
                   "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
                   f.py(v), f.left, f.left + f.width, f.left - 6, f.py(v) + 4, number(v, step(ys)));
  fmt::format_to(to, "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" class=\"box\"/>\n", f.left,
                 f.top, f.width, f.height);
  fmt::format_to(to, "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"title\">{}</text>\n",
                 f.left + f.width / 2, f.top - 9, svg_escape(c.title));
  fmt::format_to(to, "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n", f.left + f.width / 2,
                 f.top + f.height + 36, svg_escape(c.x_label));
  fmt::format_to(to, "<text transform=\"translate({:.1f},{:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                 c.left_px + 14, f.top + f.height / 2, svg_escape(c.y_label));
}

void draw_series(const ChartSeries& s, const Frame& f, fmt::memory_buffer& out) {
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "<path fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" stroke-linejoin=\"round\"{} d=\"",
                 s.colour, s.dashed ? " stroke-dasharray=\"5 3\"" : "");
  bool pen_down = false;
  double last_x = 0, last_y = 0;
  for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
    if (!std::isfinite(s.x[i]) || !std::isfinite(s.y[i])) {
      pen_down = false;
      continue;
    }
    const double x = f.px(s.x[i]), y = f.py(s.y[i]);
    if (pen_down && std::hypot(x - last_x, y - last_y) < kMinPixelStep) continue;
    fmt::format_to(to, "{}{:.1f} {:.1f}", pen_down ? "L" : "M", x, y);
    pen_down = true;
    last_x = x, last_y = y;
  }
  fmt::format_to(to, "\"/>\n");
}

}  // namespace

std::vector<double> tick_positions(double low, double high, int wanted) {
  std::vector<double> out;
  if (!(high > low) || !std::isfinite(high - low)) return out;
  const double raw = (high - low) / std::max(2, wanted);
  const double power = std::pow(10, std::floor(std::log10(raw)));
  const double mantissa = raw / power;  // in [1, 10): to the nearest of 1, 2, 5, 10
  const double step = power * (mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10);
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) out.push_back(k * step);
  return out;
}

std::string svg_escape(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out;
}

std::string draw_svg(double width_px, double height_px, const std::string& title,
                     const std::vector<LegendEntry>& legend, const std::vector<Chart>& charts) {
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
                 "font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\">\n"
                 "<style>.grid{{stroke:#e4e4e4}}.box{{fill:none;stroke:#888}}.title{{font-weight:bold}}</style>\n"
                 "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n"
                 "<text x=\"{2}\" y=\"26\" text-anchor=\"middle\" font-size=\"15\" class=\"title\">{3}</text>\n",
                 width_px, height_px, width_px / 2, svg_escape(title));
  // One row per entry: names may be long, and their width in pixels is not known here.
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const double y = 46 + 18 * static_cast<double>(i);
    fmt::format_to(to,
                   "<line x1=\"{0}\" y1=\"{1}\" x2=\"{2}\" y2=\"{1}\" stroke=\"{3}\" stroke-width=\"2.5\"{4}/>"
                   "<text x=\"{5}\" y=\"{6}\">{7}</text>\n",
                   kLeftMargin, y, kLeftMargin + 28, legend[i].colour,
                   legend[i].dashed ? " stroke-dasharray=\"5 3\"" : "", kLeftMargin + 36, y + 4,
                   svg_escape(legend[i].label));
  }
  for (const Chart& chart : charts) {
    const Frame frame = frame_of(chart);
    draw_axes(chart, frame, out);
    for (const ChartSeries& series : chart.series) draw_series(series, frame, out);
  }
  fmt::format_to(to, "</svg>\n");
  return fmt::to_string(out);
}

}  // namespace semvslam
