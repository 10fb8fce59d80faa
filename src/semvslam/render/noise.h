#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "semvslam/render/random.h"

namespace semvslam::render {

/// Smooth value noise in [0, 1) that repeats after `period` lattice cells (a power of two) in both directions.
inline float value_noise(float x, float y, std::uint32_t seed, int period) {
  const float fx = std::floor(x), fy = std::floor(y);
  const int mask = period - 1, x0 = static_cast<int>(fx) & mask, y0 = static_cast<int>(fy) & mask;
  const int x1 = (x0 + 1) & mask, y1 = (y0 + 1) & mask;
  float ax = x - fx, ay = y - fy;
  ax = ax * ax * (3.f - 2.f * ax);
  ay = ay * ay * (3.f - 2.f * ay);
  const float top = lattice_hash(x0, y0, seed) * (1.f - ax) + lattice_hash(x1, y0, seed) * ax;
  const float bottom = lattice_hash(x0, y1, seed) * (1.f - ax) + lattice_hash(x1, y1, seed) * ax;
  return top * (1.f - ay) + bottom * ay;
}

/// Sum of octaves, each twice as fine and `gain` times as strong; about [0, 1) with mean 0.5.
inline float fractal_noise(float x, float y, std::uint32_t seed, int period, int octaves, float gain = 0.5f) {
  float sum = 0, weight = 0, amplitude = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * value_noise(x, y, seed + static_cast<std::uint32_t>(i) * 101u, period);
    weight += amplitude;
    amplitude *= gain;
    x *= 2;
    y *= 2;
    period *= 2;
  }
  return sum / weight;
}

/// Smooth step from 0 at `low` to 1 at `high`.
inline float smooth_step(float low, float high, float x) {
  const float t = std::min(std::max((x - low) / (high - low), 0.f), 1.f);
  return t * t * (3.f - 2.f * t);
}

}  // namespace semvslam::render
