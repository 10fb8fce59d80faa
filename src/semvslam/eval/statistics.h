#pragma once

#include <cstddef>
#include <span>

namespace semvslam {

/// Of a list of errors, in the errors' unit. The standard deviation is that of the population (divided by n); the
/// median of an even number of values is the mean of the middle two. All zero for an empty list.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0, mean = 0, median = 0, sd = 0, min = 0, max = 0;
};

ErrorStatistics error_statistics(std::span<const double> errors);

/// What several runs gave for one number: its middle and its ends. All zero without a value.
struct Spread {
  std::size_t count = 0;
  double median = 0, min = 0, max = 0;
};

Spread spread_of(std::span<const double> values);

/// Improvement of `ours` over `other` in percent, (other - ours) / other x 100: 100 = no error left, negative = worse.
/// 0 when both are 0, minus infinity when only `other` is 0.
double improvement_percent(double other, double ours);

}  // namespace semvslam
