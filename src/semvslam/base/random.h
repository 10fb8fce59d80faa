#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace semvslam {

/// A seeded stream of random numbers: the same seed and stream name give the same numbers on every platform and
/// library, in every build (no use of <random>'s distributions, whose results are not specified, nor of the C library's
/// logarithm). Different names give independent streams, so a new user of randomness does not shift the numbers of the
/// others. Generator: xoshiro256++ (Blackman and Vigna, 2019) seeded through SplitMix64. One thread per object.
class Random {
 public:
  using result_type = std::uint64_t;
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type{0}; }

  /// @param stream the user of the numbers, e.g. "pnp.ransac".
  explicit Random(std::uint64_t seed, std::string_view stream = {});

  /// 64 random bits.
  std::uint64_t operator()();
  /// In [0, 1), multiples of 2^-53.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// In [0, count), without bias; count must not be 0.
  std::uint64_t index(std::uint64_t count);
  /// Normal distribution (Marsaglia's polar method).
  double normal(double mean = 0, double sigma = 1);
  bool chance(double probability) { return uniform() < probability; }

  /// Fisher-Yates.
  template <typename T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[index(i)]);
  }

 private:
  std::array<std::uint64_t, 4> state_{};
  double spare_normal_ = 0;
  bool has_spare_ = false;
};

}  // namespace semvslam
