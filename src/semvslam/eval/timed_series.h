#pragma once

#include <functional>
#include <vector>

#include "semvslam/base/time_stamp.h"
#include "semvslam/eval/svg_chart.h"

namespace semvslam {

/// Fills x and y of `series` with one point per moment; where nothing happened for longer than ten usual steps, but at
/// least half a second, the line is broken. @param x, y of the i-th moment
ChartSeries timed_series(ChartSeries series, const std::vector<TimeStamp>& stamps,
                         const std::function<double(std::size_t)>& x, const std::function<double(std::size_t)>& y);

}  // namespace semvslam
