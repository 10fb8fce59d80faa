#pragma once

#include <cmath>
#include <compare>
#include <cstdint>

namespace semvslam {

/// A point in time, nanoseconds since an epoch that the recording chose. An integer: 1305031102.175304 s has no exact
/// double.
struct TimeStamp {
  std::int64_t ns = 0;

  static TimeStamp from_seconds(double seconds) { return {std::llround(seconds * 1e9)}; }
  double seconds() const { return static_cast<double>(ns) * 1e-9; }
  friend constexpr auto operator<=>(TimeStamp, TimeStamp) = default;
};

}  // namespace semvslam
