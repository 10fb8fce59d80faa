#include "semvslam/base/random.h"

#include <bit>
#include <cmath>
#include <stdexcept>

namespace semvslam {
namespace {

std::uint64_t split_mix(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9E3779B97F4A7C15ull);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

// Natural logarithm of x in (0, 1] from +, * and / alone, whose results IEEE 754 fixes; std::log differs between
// libraries. log x = e log 2 + 2 atanh((m - 1) / (m + 1)) with m in [1/sqrt 2, sqrt 2); the series is exact to about
// 1e-16.
double portable_log(double x) {
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < 0.70710678118654752) m *= 2, --exponent;
  const double z = (m - 1) / (m + 1), z2 = z * z;
  double series = 0;
  for (int k = 21; k >= 1; k -= 2) series = series * z2 + 1.0 / k;
  return exponent * 0.69314718055994531 + 2 * z * series;
}

}  // namespace

Random::Random(std::uint64_t seed, std::string_view stream) {
  std::uint64_t hash = 0xCBF29CE484222325ull;  // FNV-1a of the name
  for (char c : stream) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ull;
  std::uint64_t mix = seed;
  mix = split_mix(mix) ^ hash;
  for (std::uint64_t& word : state_) word = split_mix(mix);
}

std::uint64_t Random::operator()() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Random::uniform() { return static_cast<double>((*this)() >> 11) * 0x1.0p-53; }

std::uint64_t Random::index(std::uint64_t count) {
  if (count == 0) throw std::logic_error("Random::index: nothing to choose from");
  const std::uint64_t unfair =
      (0 - count) % count;  // 2^64 mod count: this many of the smallest values are one too many
  for (;;) {
    const std::uint64_t bits = (*this)();
    if (bits >= unfair) return bits % count;
  }
}

double Random::normal(double mean, double sigma) {
  if (has_spare_) {
    has_spare_ = false;
    return mean + sigma * spare_normal_;
  }
  for (;;) {
    const double u = uniform(-1, 1), v = uniform(-1, 1);
    const double s = u * u + v * v;
    if (s >= 1 || s == 0) continue;
    const double factor = std::sqrt(-2 * portable_log(s) / s);
    spare_normal_ = v * factor;
    has_spare_ = true;
    return mean + sigma * u * factor;
  }
}

}  // namespace semvslam
