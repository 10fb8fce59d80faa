#pragma once

#include <string>
#include <vector>

namespace semvslam {

/// One bar in every group.
struct BarSeries {
  std::string label, colour;   // colour: "#rrggbb"
  std::vector<double> values;  // one per group; NaN = no bar
};

/// Bars side by side in groups, over a common axis that begins at zero. Where the largest value is more than ten
/// times the least positive one the axis is logarithmic and its label says so: small bars would not be seen otherwise.
struct BarChart {
  std::string title, y_label;
  std::vector<std::string> groups;
  std::vector<BarSeries> series;
};

/// A complete SVG document of that height; its width follows from the number of bars. Every bar carries its value.
std::string draw_bars(const BarChart& chart, double height_px);

}  // namespace semvslam
