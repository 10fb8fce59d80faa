#pragma once

#include <cmath>

// Eight doubles handled as one value, by the vector extension of GCC and Clang: one AVX-512 register, or two of AVX, or
// four of SSE. The lane count is fixed, so sums have the same order (and bits) whatever the machine offers.

namespace semvslam {

inline constexpr int kLanes = 8;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

inline Lanes broadcast(double v) { return Lanes{v, v, v, v, v, v, v, v}; }

inline Lanes sqrt_lanes(const Lanes& a) {
  Lanes out;
  for (int i = 0; i < kLanes; ++i) out[i] = std::sqrt(a[i]);
  return out;
}

inline double sum_lanes(const Lanes& a) { return ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7])); }

}  // namespace semvslam
