#include "semvslam/feature/brief_pattern.h"

namespace semvslam {
namespace {

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).
class SplitMix {
 public:
  explicit SplitMix(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }

 private:
  std::uint64_t state_;
};

/// Rounded Gaussian of standard deviation 31/5 px: twelve uniform numbers in [0, 2^16) have a sum with standard
/// deviation 2^16.
int gaussian_px(SplitMix& random) {
  std::int64_t sum = -6 * 65536;
  for (int i = 0; i < 3; ++i) {
    std::uint64_t bits = random.next();
    for (int k = 0; k < 4; ++k, bits >>= 16) sum += static_cast<std::int64_t>(bits & 0xffff);
  }
  const std::int64_t scaled = sum * 31 * 2 / (5 * 65536);  // twice the value
  return static_cast<int>(scaled >= 0 ? (scaled + 1) / 2 : -((1 - scaled) / 2));
}

std::array<BriefTest, 256> make_pattern() {
  SplitMix random(0x5E3A17);
  std::array<BriefTest, 256> tests{};
  // Rotated points are rounded, so they may come out up to 0.71 px farther than they went in.
  constexpr int kLimit = (kBriefRadius - 1) * (kBriefRadius - 1);
  for (std::size_t n = 0; n < tests.size();) {
    const int ax = gaussian_px(random), ay = gaussian_px(random), bx = gaussian_px(random), by = gaussian_px(random);
    const int dx = ax - bx, dy = ay - by;
    if (ax * ax + ay * ay > kLimit || bx * bx + by * by > kLimit) continue;
    if (dx * dx + dy * dy < 4) continue;  // neighbours in a blurred patch differ by noise only
    tests[n++] = {static_cast<std::int8_t>(ax), static_cast<std::int8_t>(ay), static_cast<std::int8_t>(bx),
                  static_cast<std::int8_t>(by)};
  }
  return tests;
}

}  // namespace

const std::array<BriefTest, 256>& brief_pattern() {
  static const std::array<BriefTest, 256> tests = make_pattern();
  return tests;
}

}  // namespace semvslam
