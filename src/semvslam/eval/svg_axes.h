#pragma once

#include <string>
#include <vector>

namespace semvslam {

/// The values that an axis shows.
struct AxisRange {
  double low = 0, high = 1;
  bool logarithmic = false;  // both ends are positive then

  /// Where a value lies between the ends: 0 = low, 1 = high. NaN where the axis has no place for it.
  double share(double value) const;
  double size() const { return high - low; }
  double middle() const { return 0.5 * (low + high); }
};

/// The finite values' ends, of a logarithmic axis the positive ones' and then rounded outwards to 1, 2 or 5 times a
/// power of ten; something around them where there is one value only, 0 to 1 (0.1 to 1) where there is none.
class AxisExtent {
 public:
  explicit AxisExtent(bool logarithmic) : logarithmic_(logarithmic) {}
  void include(const std::vector<double>& values);
  AxisRange range() const;

 private:
  const bool logarithmic_;
  bool any_ = false;
  double low_ = 0, high_ = 0;
};

/// Whether positive values from low to high differ so much that a linear axis would hide the small ones.
bool wants_logarithmic(double low, double high);

struct AxisTick {
  double value = 0;
  std::string label;
};

/// Positions for ticks: multiples of 1, 2 or 5 times a power of ten inside [low, high], about `wanted` of them.
std::vector<double> tick_positions(double low, double high, int wanted);

/// Ticks with labels of as many decimals as they need. A logarithmic axis has the powers of ten, and where these are
/// fewer than `wanted` 2 and 5 times them too.
std::vector<AxisTick> axis_ticks(const AxisRange& range, int wanted);

/// The inner box of a plot in pixels, and the part of the data's plane that it shows.
struct PlotBox {
  double left = 0, top = 0, width = 0, height = 0;
  AxisRange x, y;

  double px(double value) const { return left + x.share(value) * width; }
  double py(double value) const { return top + (1 - y.share(value)) * height; }
  /// The box inside an outer one that also has room for title, ticks and labels.
  static PlotBox inside(double left_px, double top_px, double width_px, double height_px);
};

/// The beginning of an SVG document with white background, classes of style, and a title in the middle (empty: none).
std::string open_svg(double width_px, double height_px, const std::string& title);

/// Grid, ticks and label of the y axis, the frame of the box, and the title above it. @param left_px outer left edge
std::string draw_y_axis(const PlotBox& box, double left_px, const std::string& label, const std::string& title);
/// Grid, ticks and label of the x axis.
std::string draw_x_axis(const PlotBox& box, const std::string& label);

}  // namespace semvslam
