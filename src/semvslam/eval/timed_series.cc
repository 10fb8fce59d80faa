#include "semvslam/eval/timed_series.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "semvslam/base/ranked.h"

namespace semvslam {
namespace {

/// A longer silence than this is drawn as a gap.
std::int64_t longest_step_ns(const std::vector<TimeStamp>& stamps) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i].ns - stamps[i - 1].ns);
  if (steps.empty()) return 0;
  return std::max<std::int64_t>(10 * median(std::span(steps)), 500'000'000);
}

}  // namespace

ChartSeries timed_series(ChartSeries series, const std::vector<TimeStamp>& stamps,
                         const std::function<double(std::size_t)>& x, const std::function<double(std::size_t)>& y) {
  const std::int64_t longest_ns = longest_step_ns(stamps);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (i > 0 && stamps[i].ns - stamps[i - 1].ns > longest_ns)
      series.x.push_back(kNoValue), series.y.push_back(kNoValue);
    series.x.push_back(x(i));
    series.y.push_back(y(i));
  }
  return series;
}

}  // namespace semvslam
