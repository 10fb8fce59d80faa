#include "semvslam/eval/svg_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "semvslam/eval/markup.h"

namespace semvslam {
namespace {

constexpr double kLeftMargin_px = 70, kRightMargin_px = 14, kTopMargin_px = 28, kBottomMargin_px = 46;

std::string number(double v, double step) {
  if (std::abs(v) < 1e-9 * step) v = 0;
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  return fmt::format("{:.{}f}", v, decimals);
}

/// The multiple of a power of ten by 1, 2 or 5 that is nearest below (or above) a positive value.
double round_in_decades(double value, bool up) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  const double mantissa = value / power;  // in [1, 10)
  constexpr double kSteps[] = {1, 2, 5, 10};
  if (up) return power * *std::find_if(kSteps, kSteps + 3, [&](double s) { return s >= mantissa * (1 - 1e-9); });
  return power * (mantissa >= 5 ? 5 : mantissa >= 2 ? 2 : 1);
}

std::vector<AxisTick> decade_ticks(const AxisRange& range, int wanted) {
  std::vector<AxisTick> out;
  const int first = static_cast<int>(std::floor(std::log10(range.low) + 1e-9));
  const int last = static_cast<int>(std::floor(std::log10(range.high) + 1e-9));
  const bool between = last - first + 1 < wanted;
  for (int power = first; power <= last; ++power)
    for (int factor : {1, 2, 5}) {
      const double v = factor * std::pow(10, power);
      if ((factor == 1 || between) && v >= range.low * (1 - 1e-9) && v <= range.high * (1 + 1e-9))
        out.push_back({v, number(v, std::pow(10, power))});
    }
  return out;
}

}  // namespace

double AxisRange::share(double value) const {
  if (!logarithmic) return (value - low) / size();
  if (!(value > 0)) return std::numeric_limits<double>::quiet_NaN();
  return std::log(value / low) / std::log(high / low);
}

bool wants_logarithmic(double low, double high) {
  constexpr double kRatio = 10;
  return high > kRatio * low;
}

void AxisExtent::include(const std::vector<double>& values) {
  for (double v : values) {
    if (!std::isfinite(v) || (logarithmic_ && v <= 0)) continue;
    low_ = any_ ? std::min(low_, v) : v;
    high_ = any_ ? std::max(high_, v) : v;
    any_ = true;
  }
}

AxisRange AxisExtent::range() const {
  if (logarithmic_) {
    if (!any_) return {0.1, 1, true};
    const double low = round_in_decades(low_, false), high = round_in_decades(high_, true);
    return {low, high > low ? high : 10 * low, true};
  }
  if (!any_) return {};
  if (high_ - low_ < 1e-9) return {low_ - 0.5e-3, high_ + 0.5e-3};
  return {low_, high_};
}

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

std::vector<AxisTick> axis_ticks(const AxisRange& range, int wanted) {
  if (range.logarithmic) return decade_ticks(range, wanted);
  const std::vector<double> positions = tick_positions(range.low, range.high, wanted);
  const double step = positions.size() > 1 ? positions[1] - positions[0] : 1.0;
  std::vector<AxisTick> out;
  for (double v : positions) out.push_back({v, number(v, step)});
  return out;
}

PlotBox PlotBox::inside(double left_px, double top_px, double width_px, double height_px) {
  return {left_px + kLeftMargin_px,
          top_px + kTopMargin_px,
          width_px - kLeftMargin_px - kRightMargin_px,
          height_px - kTopMargin_px - kBottomMargin_px,
          {},
          {}};
}

std::string open_svg(double width_px, double height_px, const std::string& title) {
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\">\n"
      "<style>.grid{{stroke:#e4e4e4}}.box{{fill:none;stroke:#888}}.title{{font-weight:bold}}</style>\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
      width_px, height_px);
  if (!title.empty())
    out += fmt::format("<text x=\"{}\" y=\"26\" text-anchor=\"middle\" font-size=\"15\" class=\"title\">{}</text>\n",
                       width_px / 2, escape_markup(title));
  return out;
}

std::string draw_y_axis(const PlotBox& box, double left_px, const std::string& label, const std::string& title) {
  std::string out;
  for (const AxisTick& tick : axis_ticks(box.y, static_cast<int>(box.height / 45)))
    out += fmt::format(
        "<line x1=\"{1:.1f}\" y1=\"{0:.1f}\" x2=\"{2:.1f}\" y2=\"{0:.1f}\" class=\"grid\"/>"
        "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
        box.py(tick.value), box.left, box.left + box.width, box.left - 6, box.py(tick.value) + 4, tick.label);
  out += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" class=\"box\"/>\n", box.left,
                     box.top, box.width, box.height);
  out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"title\">{}</text>\n",
                     box.left + box.width / 2, box.top - 9, escape_markup(title));
  return out +
         fmt::format("<text transform=\"translate({:.1f},{:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     left_px + 14, box.top + box.height / 2, escape_markup(label));
}

std::string draw_x_axis(const PlotBox& box, const std::string& label) {
  std::string out;
  for (const AxisTick& tick : axis_ticks(box.x, static_cast<int>(box.width / 80)))
    out += fmt::format(
        "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{0:.1f}\" y2=\"{2:.1f}\" class=\"grid\"/>"
        "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4}</text>\n",
        box.px(tick.value), box.top, box.top + box.height, box.top + box.height + 17, tick.label);
  return out + fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                           box.left + box.width / 2, box.top + box.height + 36, escape_markup(label));
}

}  // namespace semvslam
