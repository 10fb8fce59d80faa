#include "semvslam/eval/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace semvslam {

ErrorStatistics error_statistics(std::span<const double> errors) {
  ErrorStatistics out;
  out.count = errors.size();
  if (errors.empty()) return out;
  const double n = static_cast<double>(errors.size());
  double sum = 0, squares = 0;
  for (double e : errors) sum += e, squares += e * e;
  out.mean = sum / n;
  out.rmse = std::sqrt(squares / n);
  double spread = 0;  // in a second pass: the difference of the two sums above loses all digits for nearly equal errors
  for (double e : errors) spread += (e - out.mean) * (e - out.mean);
  out.sd = std::sqrt(spread / n);

  std::vector<double> sorted(errors.begin(), errors.end());
  std::sort(sorted.begin(), sorted.end());
  out.min = sorted.front();
  out.max = sorted.back();
  const std::size_t middle = sorted.size() / 2;
  out.median = sorted.size() % 2 == 1 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
  return out;
}

Spread spread_of(std::span<const double> values) {
  const ErrorStatistics s = error_statistics(values);
  return {s.count, s.median, s.min, s.max};
}

double improvement_percent(double other, double ours) {
  if (other == 0) return ours == 0 ? 0 : -std::numeric_limits<double>::infinity();
  return (other - ours) / other * 100;
}

}  // namespace semvslam
