#pragma once

#include <cmath>
#include <cstdint>

namespace semvslam::render {

/// Mixes 64 bits (the finaliser of SplitMix64, Steele et al. 2014).
inline std::uint64_t mix64(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

inline std::uint64_t mix64(std::uint64_t a, std::uint64_t b) { return mix64(mix64(a) ^ (b * 0xD6E8FEB86659FD93ull)); }

/// A cheap hash of a lattice point, for noise: uniform in [0, 1).
inline float lattice_hash(int x, int y, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9E3779B1u ^ static_cast<std::uint32_t>(x) * 0x85EBCA77u;
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du + static_cast<std::uint32_t>(y) * 0xC2B2AE3Du;
  h = (h ^ (h >> 13)) * 0x297A2D39u;
  h ^= h >> 16;
  return static_cast<float>(h >> 8) * (1.0f / 16777216.0f);
}

/// A stream of numbers that is the same on every machine (the standard library's distributions are not).
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed) : state_(mix64(seed)) {}
  std::uint64_t bits() { return mix64(state_ += 0x9E3779B97F4A7C15ull); }
  std::uint32_t bits32() { return static_cast<std::uint32_t>(bits()); }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in {0, ..., n - 1}; n > 0.
  int below(int n) { return static_cast<int>(uniform() * n); }
  bool chance(double probability) { return uniform() < probability; }
  /// Standard normal (Box-Muller).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * M_PI * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace semvslam::render
