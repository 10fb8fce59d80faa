#include "semvslam/eval/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "semvslam/eval/markup.h"
#include "semvslam/eval/svg_axes.h"

namespace semvslam {
namespace {

constexpr double kLegendLeft_px = 70;
constexpr double kMinPixelStep = 0.4;  // nearer points than this are not drawn: files stay small

AxisRange range_of(const std::vector<ChartSeries>& series, std::vector<double> ChartSeries::*values, bool logarithmic) {
  AxisExtent extent(logarithmic);
  for (const ChartSeries& s : series) extent.include(s.*values);
  return extent.range();
}

void widen(AxisRange& range, double share) {
  const double by = share * range.size();
  range.low -= by;
  range.high += by;
}

PlotBox box_of(const Chart& c) {
  PlotBox box = PlotBox::inside(c.left_px, c.top_px, c.width_px, c.height_px);
  box.x = range_of(c.series, &ChartSeries::x, false);
  box.y = range_of(c.series, &ChartSeries::y, c.y_logarithmic);
  if (c.equal_aspect) widen(box.x, 0.05);
  if (!c.y_logarithmic) widen(box.y, 0.05);
  if (c.y_from_zero && !c.y_logarithmic) box.y.low = 0;
  if (c.equal_aspect) {
    const double unit = std::max(box.x.size() / box.width, box.y.size() / box.height);  // data per pixel
    box.x = {box.x.middle() - 0.5 * unit * box.width, box.x.middle() + 0.5 * unit * box.width};
    box.y = {box.y.middle() - 0.5 * unit * box.height, box.y.middle() + 0.5 * unit * box.height};
  }
  return box;
}

void draw_series(const ChartSeries& s, const PlotBox& box, fmt::memory_buffer& out) {
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "<path fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"{} d=\"", s.colour,
                 s.width_px, s.dashed ? " stroke-dasharray=\"5 3\"" : "");
  bool pen_down = false;
  double last_x = 0, last_y = 0;
  for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
    const double x = box.px(s.x[i]), y = box.py(s.y[i]);
    if (!std::isfinite(x) || !std::isfinite(y)) {
      pen_down = false;
      continue;
    }
    if (pen_down && std::hypot(x - last_x, y - last_y) < kMinPixelStep) continue;
    fmt::format_to(to, "{}{:.1f} {:.1f}", pen_down ? "L" : "M", x, y);
    pen_down = true;
    last_x = x, last_y = y;
  }
  fmt::format_to(to, "\"/>\n");
}

}  // namespace

std::string draw_svg(double width_px, double height_px, const std::string& title,
                     const std::vector<LegendEntry>& legend, const std::vector<Chart>& charts) {
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "{}", open_svg(width_px, height_px, title));
  // One row per entry: names may be long, and their width in pixels is not known here.
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const double y = 46 + 18 * static_cast<double>(i);
    fmt::format_to(to,
                   "<line x1=\"{0}\" y1=\"{1}\" x2=\"{2}\" y2=\"{1}\" stroke=\"{3}\" stroke-width=\"2.5\"{4}/>"
                   "<text x=\"{5}\" y=\"{6}\">{7}</text>\n",
                   kLegendLeft_px, y, kLegendLeft_px + 28, legend[i].colour,
                   legend[i].dashed ? " stroke-dasharray=\"5 3\"" : "", kLegendLeft_px + 36, y + 4,
                   escape_markup(legend[i].label));
  }
  for (const Chart& chart : charts) {
    const PlotBox box = box_of(chart);
    fmt::format_to(to, "{}{}", draw_x_axis(box, chart.x_label),
                   draw_y_axis(box, chart.left_px, chart.y_label, chart.title));
    for (const ChartSeries& series : chart.series) draw_series(series, box, out);
  }
  fmt::format_to(to, "</svg>\n");
  return fmt::to_string(out);
}

}  // namespace semvslam
