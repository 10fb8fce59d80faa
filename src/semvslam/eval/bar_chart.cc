#include "semvslam/eval/bar_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "semvslam/eval/markup.h"
#include "semvslam/eval/svg_axes.h"
#include "semvslam/eval/table.h"

namespace semvslam {
namespace {

constexpr double kBarWidth_px = 24, kGroupGap_px = 26, kLeastWidth_px = 420;
constexpr double kHeadRoom = 0.1, kHeadRoomUpwards = 0.22;  // for the value on the largest bar, share of the axis
constexpr double kDigitWidth_px = 6;                        // of the values on the bars, at most

/// Beside each other the values need no more room than the bars; longer ones are written upwards.
bool is_upwards(const std::string& text) {
  return static_cast<double>(text.size()) * kDigitWidth_px > kBarWidth_px + 2;
}

AxisRange axis_of(const BarChart& chart) {
  double low = INFINITY, high = 0, room = kHeadRoom;
  AxisExtent extent(true);
  for (const BarSeries& s : chart.series) {
    extent.include(s.values);
    for (double v : s.values) {
      if (!(std::isfinite(v) && v > 0)) continue;
      low = std::min(low, v), high = std::max(high, v);
      if (is_upwards(three_digits(v))) room = kHeadRoomUpwards;
    }
  }
  if (!wants_logarithmic(low, high)) return {0, high > 0 ? high / (1 - room) : 1.0};
  AxisRange range = extent.range();
  if (range.low > 0.7 * low) range.low *= 0.5;  // the least bar should be seen
  while (range.share(high) > 1 - room) range.high *= 1.5;
  return range;
}

std::string draw_bar(const PlotBox& box, double left, double value, const BarSeries& series) {
  const double share = box.y.share(value);
  if (!std::isfinite(share)) return {};
  const double top = box.py(value);
  const std::string text = three_digits(value);
  const bool upwards = is_upwards(text);
  const double middle = left + kBarWidth_px / 2;
  return fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>"
      "<text font-size=\"10\" transform=\"translate({:.1f},{:.1f}){}\" text-anchor=\"{}\">{}</text>\n",
      left + 1, top, kBarWidth_px - 2, box.top + box.height - top, series.colour, middle + (upwards ? 3.5 : 0), top - 4,
      upwards ? " rotate(-90)" : "", upwards ? "start" : "middle", text);
}

}  // namespace

std::string draw_bars(const BarChart& chart, double height_px) {
  const double group = kBarWidth_px * static_cast<double>(chart.series.size()) + kGroupGap_px;
  const double groups = static_cast<double>(chart.groups.size());
  PlotBox box = PlotBox::inside(0, 0, 1000, height_px);
  const double margins = 1000 - box.width;
  box.width = std::max(kLeastWidth_px - margins, group * groups);
  box.y = axis_of(chart);
  const double pitch = box.width / std::max(1.0, groups);

  // Group names are written across where all have the room, else slanting, with as much room below as they need.
  std::size_t longest = 0;
  for (const std::string& name : chart.groups) longest = std::max(longest, name.size());
  const double name_px = 7.2 * static_cast<double>(longest);
  const bool slanting = name_px > pitch - 4;
  const double below = slanting ? 0.5 * name_px + 16 : 24;
  box.height = height_px - box.top - below;

  std::string out = open_svg(box.width + margins, height_px, "");
  out += draw_y_axis(box, 0, chart.y_label + (box.y.logarithmic ? ", logarithmic" : ""), chart.title);
  for (std::size_t g = 0; g < chart.groups.size(); ++g) {
    const double middle = box.left + (static_cast<double>(g) + 0.5) * pitch;
    double left = middle - 0.5 * (group - kGroupGap_px);
    for (const BarSeries& series : chart.series) {
      out += draw_bar(box, left, series.values.at(g), series);
      left += kBarWidth_px;
    }
    out += fmt::format("<text transform=\"translate({:.1f},{:.1f}){}\" text-anchor=\"{}\">{}</text>\n", middle,
                       box.top + box.height + 17, slanting ? " rotate(-30)" : "", slanting ? "end" : "middle",
                       escape_markup(chart.groups[g]));
  }
  return out + "</svg>\n";
}

}  // namespace semvslam
