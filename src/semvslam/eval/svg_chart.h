#pragma once

#include <limits>
#include <string>
#include <vector>

namespace semvslam {

/// Of the same thing in every drawing: the truth, the estimate that matters, the one it is compared with.
inline constexpr const char* kTruthColour = "#555555";
inline constexpr const char* kEstimateColour = "#0868ac";
inline constexpr const char* kAgainstColour = "#e6740b";

/// Breaks a line; in a bar chart, no bar.
inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// One line of a chart. A NaN in x or y breaks the line.
struct ChartSeries {
  std::string label, colour;  // colour: "#rrggbb"
  std::vector<double> x, y;
  bool dashed = false;
  double width_px = 1.6;
};

/// A chart with axes, ticks and grid, placed in an SVG drawing.
struct Chart {
  std::string title, x_label, y_label;
  double left_px = 0, top_px = 0, width_px = 0, height_px = 0;  // the outer box, labels included
  bool equal_aspect = false;                                    // one unit is as long on both axes
  bool y_from_zero = false;
  std::vector<ChartSeries> series;
  bool y_logarithmic = false;  // what is not positive breaks the line
};

/// What one line means.
struct LegendEntry {
  std::string label, colour;
  bool dashed = false;
};

/// A complete SVG document with white background, a title, a legend line below it, and the charts.
std::string draw_svg(double width_px, double height_px, const std::string& title,
                     const std::vector<LegendEntry>& legend, const std::vector<Chart>& charts);

}  // namespace semvslam
