#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace semvslam {

/// The element that `rank` others come before in ascending order. Reorders the values. @param rank below their number.
template <typename T>
T ranked(std::span<T> values, std::size_t rank) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The element in the middle; of an even number the upper one. Reorders the values, of which there must be one.
template <typename T>
T median(std::span<T> values) {
  return ranked(values, values.size() / 2);
}

/// The element that a share of the others, in [0, 1), come before. Reorders the values, of which there must be one.
template <typename T>
T quantile(std::span<T> values, double share) {
  return ranked(values, static_cast<std::size_t>(share * static_cast<double>(values.size())));
}

}  // namespace semvslam
