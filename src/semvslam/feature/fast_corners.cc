#include "semvslam/feature/fast_corners.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "semvslam/feature/blocks.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace semvslam {
namespace {

using Pixel = std::uint8_t;
inline Pixel lower(Pixel a, Pixel b) { return a < b ? a : b; }
inline Pixel upper(Pixel a, Pixel b) { return a > b ? a : b; }
inline Pixel excess(Pixel a, Pixel b) { return static_cast<Pixel>(a > b ? a - b : 0); }

/// The circle of 16 pixels around a centre, from the top clockwise.
using Circle = std::array<Pixel, 16>;

/// inner = lower, outer = upper: the darkest pixel of the best bright arc of nine; the other way round, the brightest
/// of the best dark arc.
///
/// max over arcs of min over nine: the arcs i-1..i+7 and i..i+8 share the eight pixels i..i+7, so that
/// max(min(eight, p[i-1]), min(eight, p[i+8])) = min(eight, max(p[i-1], p[i+8])), and only the even i are needed.
template <typename Inner, typename Outer>
inline Pixel best_arc(const Circle& p, Inner inner, Outer outer) {
  std::array<Pixel, 8> two, four;  // [i]: of the pixels from 2 i on
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 8; ++i) two[i] = inner(p[2 * i], p[2 * i + 1]);
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 8; ++i) four[i] = inner(two[i], two[(i + 1) % 8]);
  Pixel best = inner(inner(four[0], four[2]), outer(p[15], p[8]));
#pragma GCC unroll 8
  for (std::size_t i = 1; i < 8; ++i)
    best = outer(best, inner(inner(four[i], four[(i + 2) % 8]), outer(p[2 * i - 1], p[(2 * i + 8) % 16])));
  return best;
}

/// For n pixels from `centre` on: by how much the darkest pixel of the best bright arc exceeds the centre, or the
/// brightest of the best dark arc falls below it, whichever is more. A corner at threshold t has more than t.
void score_row(const Pixel* centre, std::ptrdiff_t stride, int n, Pixel* __restrict score) {
  const Pixel *u3 = centre - 3 * stride, *u2 = centre - 2 * stride, *u1 = centre - stride;
  const Pixel *d3 = centre + 3 * stride, *d2 = centre + 2 * stride, *d1 = centre + stride;
  for_each_block(n, [=](int first, auto size) {
    const int end = first + size;
#pragma GCC ivdep
    for (int x = first; x < end; ++x) {
      const Circle circle{u3[x], u3[x + 1], u2[x + 2], u1[x + 3], centre[x + 3], d1[x + 3], d2[x + 2], d3[x + 1],
                          d3[x], d3[x - 1], d2[x - 2], d1[x - 3], centre[x - 3], u1[x - 3], u2[x - 2], u3[x - 1]};
      const Pixel bright = best_arc(circle, lower, upper), dark = best_arc(circle, upper, lower);
      score[x] = upper(excess(bright, centre[x]), excess(centre[x], dark));
    }
  });
}

/// mark[x] = 1 where row[x] is above the threshold and a maximum of its 3x3 neighbourhood.
void mark_maxima(const Pixel* above, const Pixel* row, const Pixel* below, int n, Pixel threshold,
                 Pixel* __restrict mark) {
  for_each_block(n, [=](int first, auto size) {
    const int end = first + size;
#pragma GCC ivdep
    for (int x = first; x < end; ++x) {
      const Pixel before = upper(upper(above[x - 1], above[x]), upper(above[x + 1], row[x - 1]));
      const Pixel after = upper(upper(below[x - 1], below[x]), upper(below[x + 1], row[x + 1]));
      const Pixel s = row[x];
      mark[x] = static_cast<Pixel>((s > upper(before, threshold)) & (s >= after));
    }
  });
}

/// Bit i is mark[i], which is 0 or 1.
std::uint64_t pack_marks(const Pixel* mark) {
#ifdef __AVX2__
  const auto half = [&](int at) {
    const __m256i bytes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(mark + at));
    return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_slli_epi16(bytes, 7)));
  };
  return half(0) | static_cast<std::uint64_t>(half(32)) << 32;
#else
  std::uint64_t bits = 0;
  for (int i = 0; i < 64; ++i) bits |= static_cast<std::uint64_t>(mark[i]) << i;
  return bits;
#endif
}

}  // namespace

void FastDetector::detect(const cv::Mat& image, int border, int threshold, std::vector<Corner>& out) {
  out.clear();
  const int x0 = border, y0 = border, width = image.cols - 2 * border, height = image.rows - 2 * border;
  if (width <= 0 || height <= 0) return;
  // One pixel more on every side is scored, for the comparison with neighbours.
  const int n = width + 2;
  const auto pitch = static_cast<std::size_t>((n + 63) / 64 * 64);
  rows_.resize(4 * pitch);
  std::array<Pixel*, 3> scores{rows_.data(), rows_.data() + pitch, rows_.data() + 2 * pitch};
  Pixel* mark = rows_.data() + 3 * pitch;
  std::memset(mark, 0, pitch);
  const auto stride = static_cast<std::ptrdiff_t>(image.step[0]);
  const auto score_image_row = [&](int y, Pixel* to) { score_row(image.ptr<Pixel>(y) + x0 - 1, stride, n, to); };
  std::size_t count = 0;
  score_image_row(y0 - 1, scores[0]);
  score_image_row(y0, scores[1]);
  for (int y = y0; y < y0 + height; ++y) {
    score_image_row(y + 1, scores[2]);
    mark_maxima(scores[0] + 1, scores[1] + 1, scores[2] + 1, width, static_cast<Pixel>(threshold), mark);
    if (found_.size() < count + pitch) found_.resize(2 * (count + pitch));
    for (std::size_t x = 0; x < pitch; x += 64) {
      for (std::uint64_t bits = pack_marks(mark + x); bits != 0; bits &= bits - 1) {
        const std::size_t i = x + static_cast<std::size_t>(std::countr_zero(bits));
        found_[count++] = {static_cast<std::uint16_t>(static_cast<int>(i) + x0), static_cast<std::uint16_t>(y),
                           static_cast<std::uint16_t>(scores[1][i + 1] - 1)};
      }
    }
    std::rotate(scores.begin(), scores.begin() + 1, scores.end());
  }
  out.assign(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace semvslam
