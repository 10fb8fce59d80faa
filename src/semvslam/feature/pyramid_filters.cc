#include "semvslam/feature/pyramid_filters.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "semvslam/feature/blocks.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace semvslam {
namespace {

constexpr int kOne = 64;      // weights of a pair sum to this
constexpr int kGroup = 8;     // pixels that one shuffle makes
constexpr int kPadding = 64;  // readable bytes behind a buffered row

std::uint8_t mix(int a, int b, int second_64) {
  return static_cast<std::uint8_t>((a * (kOne - second_64) + b * second_64 + kOne / 2) / kOne);
}

void mix_rows(const std::uint8_t* a, const std::uint8_t* b, int second_64, int n, std::uint8_t* __restrict out) {
  const auto wa = static_cast<std::uint16_t>(kOne - second_64), wb = static_cast<std::uint16_t>(second_64);
  for_each_block(n, [=](int first, auto size) {
    const int end = first + size;
#pragma GCC ivdep
    for (int x = first; x < end; ++x) {
      out[x] = static_cast<std::uint8_t>(static_cast<std::uint16_t>(a[x] * wa + b[x] * wb + kOne / 2) / kOne);
    }
  });
}

inline std::uint8_t average(std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>((a + b + 1) >> 1); }

/// (1 2 3 4 3 2 1) / 16 of seven values: four neighbours averaged, and of four such averages again.
inline std::uint8_t triangle(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d, std::uint8_t e,
                             std::uint8_t f, std::uint8_t g) {
  const std::uint8_t ab = average(a, b), bc = average(b, c), cd = average(c, d), de = average(d, e), ef = average(e, f),
                     fg = average(f, g);
  return average(average(average(ab, cd), average(bc, de)), average(average(cd, ef), average(de, fg)));
}

}  // namespace

void Shrinker::Axis::prepare(int src_size, int dst_size) {
  src = src_size;
  dst = dst_size;
  const auto n = static_cast<std::size_t>(dst);
  const std::size_t padded = (n + 4 * kGroup - 1) / (4 * kGroup) * (4 * kGroup);
  first.assign(padded, 0);
  second_64.assign(padded, 0);
  shuffle.assign(2 * padded, 0);
  weights.assign(2 * padded, 0);
  const double ratio = static_cast<double>(src) / dst;
  for (std::size_t i = 0; i < padded; ++i) {
    const double at = (static_cast<double>(std::min(i, n - 1)) + 0.5) * ratio - 0.5;
    const auto position = std::clamp<long>(std::lround(at * kOne), 0, static_cast<long>(src - 1) * kOne);
    first[i] = std::min(static_cast<int>(position / kOne), src - 2);
    second_64[i] = static_cast<std::uint8_t>(position - static_cast<long>(first[i]) * kOne);
  }
  shuffles = true;
  for (std::size_t i = 0; i < padded; ++i) {
    const int offset = first[i] - first[i / kGroup * kGroup];
    shuffles = shuffles && offset + 1 < 16;
    shuffle[2 * i] = static_cast<std::int8_t>(offset);
    shuffle[2 * i + 1] = static_cast<std::int8_t>(offset + 1);
    weights[2 * i] = static_cast<std::int8_t>(kOne - second_64[i]);
    weights[2 * i + 1] = static_cast<std::int8_t>(second_64[i]);
  }
}

const Shrinker::Axis& Shrinker::axis_for(std::vector<Axis>& axes, int src_size, int dst_size) {
  for (const Axis& axis : axes) {
    if (axis.src == src_size && axis.dst == dst_size) return axis;
  }
  if (axes.size() >= 64) axes.clear();  // a stream of ever new sizes must not grow without bound
  axes.emplace_back().prepare(src_size, dst_size);
  return axes.back();
}

/// @param src readable for kPadding bytes beyond its end. @param dst writable up to the next multiple of 32 pixels.
void Shrinker::shrink_row(const std::uint8_t* src, const Axis& axis, std::uint8_t* dst) const {
#ifdef __AVX2__
  if (axis.shuffles) {
    const __m256i half = _mm256_set1_epi16(kOne / 2);
    const auto sixteen = [&](std::size_t x) {
      const __m128i a = _mm_loadu_si128(reinterpret_cast<const __m128i*>(src + axis.first[x]));
      const __m128i b = _mm_loadu_si128(reinterpret_cast<const __m128i*>(src + axis.first[x + kGroup]));
      const __m256i pairs = _mm256_shuffle_epi8(
          _mm256_set_m128i(b, a), _mm256_loadu_si256(reinterpret_cast<const __m256i*>(&axis.shuffle[2 * x])));
      const __m256i sum =
          _mm256_maddubs_epi16(pairs, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(&axis.weights[2 * x])));
      return _mm256_srli_epi16(_mm256_add_epi16(sum, half), 6);
    };
    static_assert(kOne == 1 << 6);
    for (std::size_t x = 0; x < static_cast<std::size_t>(axis.dst); x += 32) {
      const __m256i packed = _mm256_packus_epi16(sixteen(x), sixteen(x + 16));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(dst + x), _mm256_permute4x64_epi64(packed, 0xd8));
    }
    return;
  }
#endif
  for (std::size_t x = 0; x < static_cast<std::size_t>(axis.dst); ++x) {
    dst[x] = mix(src[axis.first[x]], src[axis.first[x] + 1], axis.second_64[x]);
  }
}

void Shrinker::shrink(const cv::Mat& src, cv::Mat& dst) {
  if (src.cols < 2 || src.rows < 2 || dst.empty() || dst.cols > src.cols || dst.rows > src.rows) {
    throw std::invalid_argument("Shrinker: the result must not be empty nor larger than the image");
  }
  const Axis& x_axis = axis_for(x_axes_, src.cols, dst.cols);
  const Axis& y_axis = axis_for(y_axes_, src.rows, dst.rows);
  const std::size_t half = static_cast<std::size_t>(src.cols) + kPadding;
  row_.resize(2 * half);
  std::uint8_t* shrunk = row_.data() + half;  // a whole number of groups is written, dst has no room for that
  for (int y = 0; y < dst.rows; ++y) {
    const auto i = static_cast<std::size_t>(y);
    const auto* a = src.ptr<std::uint8_t>(y_axis.first[i]);
    const auto* b = src.ptr<std::uint8_t>(y_axis.first[i] + 1);
    mix_rows(a, b, y_axis.second_64[i], src.cols, row_.data());
    shrink_row(row_.data(), x_axis, shrunk);
    std::copy_n(shrunk, dst.cols, dst.ptr<std::uint8_t>(y));
  }
}

void Smoother::smooth(const cv::Mat& src, cv::Mat& dst) {
  const int n = src.cols;
  row_.resize(static_cast<std::size_t>(n));
  for (int y = kSmoothReach; y < src.rows - kSmoothReach; ++y) {
    const std::uint8_t *a = src.ptr(y - 3), *b = src.ptr(y - 2), *c = src.ptr(y - 1), *d = src.ptr(y),
                       *e = src.ptr(y + 1), *f = src.ptr(y + 2), *g = src.ptr(y + 3);
    std::uint8_t* __restrict column = row_.data();
    for_each_block(n, [=](int first, auto size) {
      const int end = first + size;
#pragma GCC ivdep
      for (int x = first; x < end; ++x) column[x] = triangle(a[x], b[x], c[x], d[x], e[x], f[x], g[x]);
    });
    std::uint8_t* __restrict out = dst.ptr(y) + kSmoothReach;
    for_each_block(n - 2 * kSmoothReach, [=](int first, auto size) {
      const int end = first + size;
#pragma GCC ivdep
      for (int x = first; x < end; ++x) {
        out[x] = triangle(column[x], column[x + 1], column[x + 2], column[x + 3], column[x + 4], column[x + 5],
                          column[x + 6]);
      }
    });
  }
}

}  // namespace semvslam
