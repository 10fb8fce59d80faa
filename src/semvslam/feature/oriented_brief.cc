#include "semvslam/feature/oriented_brief.h"

#include <cmath>
#include <cstring>
#include <numbers>

#include "semvslam/feature/brief_pattern.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

// Vectors wider than the target's registers are passed in another way than with wider ones: of no matter within one
// file.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace semvslam {
namespace {

constexpr float kTurn = 2 * std::numbers::pi_v<float>;
constexpr int kColumns = 32;  // of the patch and one more, a whole vector

/// Vectors of the compiler (GCC, clang): they become whatever registers the target has, with one result on all of them.
using Bytes = std::uint8_t __attribute__((vector_size(kColumns)));
using Shorts = std::int16_t __attribute__((vector_size(2 * kColumns)));

/// Row dy of the disc: 0xff inside, 0 outside.
std::array<std::array<std::uint8_t, kColumns>, kPatchRadius + 1> disc_rows() {
  std::array<std::array<std::uint8_t, kColumns>, kPatchRadius + 1> rows{};
  for (int dy = 0; dy <= kPatchRadius; ++dy) {
    for (int dx = -kPatchRadius; dx <= kPatchRadius; ++dx) {
      const bool inside = 4 * (dx * dx + dy * dy) <= (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);
      rows[static_cast<std::size_t>(dy)][static_cast<std::size_t>(dx + kPatchRadius)] = inside ? 0xff : 0;
    }
  }
  return rows;
}

Shorts load(const std::uint8_t* from, const std::array<std::uint8_t, kColumns>& keep) {
  Bytes bytes, mask;
  std::memcpy(&bytes, from, sizeof bytes);
  std::memcpy(&mask, keep.data(), sizeof mask);
  return __builtin_convertvector(bytes & mask, Shorts);
}

/// Bit i is a[i] < b[i]. Both are aligned to 32 bytes.
std::uint64_t less_bits(const std::uint8_t* a, const std::uint8_t* b) {
#ifdef __AVX2__
  const auto half = [&](int at) {
    const __m256i x = _mm256_load_si256(reinterpret_cast<const __m256i*>(a + at));
    const __m256i y = _mm256_load_si256(reinterpret_cast<const __m256i*>(b + at));
    const __m256i not_less = _mm256_cmpeq_epi8(_mm256_max_epu8(x, y), x);
    return static_cast<std::uint32_t>(~_mm256_movemask_epi8(not_less));
  };
  return half(0) | static_cast<std::uint64_t>(half(32)) << 32;
#else
  std::uint64_t bits = 0;
  for (int i = 0; i < 64; ++i) bits |= static_cast<std::uint64_t>(a[i] < b[i]) << i;
  return bits;
#endif
}

}  // namespace

float patch_angle_rad(const std::uint8_t* centre, std::ptrdiff_t stride) {
  static const auto disc = disc_rows();
  const std::uint8_t* left = centre - kPatchRadius;
  // Per column: sum of the pixels (at most 31 * 255), and sum of the pixels times dy (at most 120 * 255): both fit 16
  // bits.
  Shorts columns = load(left, disc[0]);
  Shorts tilt{};
  for (int dy = 1; dy <= kPatchRadius; ++dy) {
    const Shorts below = load(left + dy * stride, disc[static_cast<std::size_t>(dy)]);
    const Shorts above = load(left - dy * stride, disc[static_cast<std::size_t>(dy)]);
    columns += below + above;
    tilt += static_cast<std::int16_t>(dy) * (below - above);
  }
  int m10 = 0, m01 = 0;
  for (int i = 0; i < kColumns; ++i) {
    m10 += (i - kPatchRadius) * columns[i];
    m01 += tilt[i];
  }
  const float angle = std::atan2(static_cast<float>(m01), static_cast<float>(m10));
  const float positive = angle < 0 ? angle + kTurn : angle;
  return positive < kTurn ? positive : 0.f;
}

OrientedBrief::OrientedBrief() {
  points_.reserve(kAngles * kPoints);
  for (int a = 0; a < kAngles; ++a) {
    const double angle = a * 2 * std::numbers::pi / kAngles, c = std::cos(angle), s = std::sin(angle);
    const auto add = [&](int x, int y) {
      points_.push_back(
          {static_cast<std::int8_t>(std::lround(c * x - s * y)), static_cast<std::int8_t>(std::lround(s * x + c * y))});
    };
    for (const BriefTest& test : brief_pattern()) {
      add(test.ax, test.ay);
      add(test.bx, test.by);
    }
  }
}

void OrientedBrief::set_stride(std::ptrdiff_t stride) {
  if (stride == stride_) return;
  stride_ = stride;
  offsets_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    offsets_[i] = static_cast<std::int32_t>(points_[i].y * stride + points_[i].x);
  }
}

Descriptor OrientedBrief::describe(const std::uint8_t* centre, float angle_rad) const {
  const auto step = static_cast<std::size_t>(std::lround(angle_rad * (kAngles / kTurn))) % kAngles;
  const std::int32_t* offset = offsets_.data() + step * kPoints;
  // All are fetched, then compared at once: half of the instructions of test after test. A vector that is read across
  // bytes just written waits until they are done: by then they are.
  alignas(64) std::array<std::uint8_t, kPoints / 2> a, b;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = centre[offset[2 * i]];
    b[i] = centre[offset[2 * i + 1]];
  }
  Descriptor descriptor{};
  for (std::size_t w = 0; w < descriptor.size(); ++w) descriptor[w] = less_bits(a.data() + 64 * w, b.data() + 64 * w);
  return descriptor;
}

}  // namespace semvslam
