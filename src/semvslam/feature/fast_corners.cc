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

/// For n pixels from `centre` on: by how much the darkest pixel of the best bright arc exceeds the centre, or the
/// brightest of the best dark arc falls below it, whichever is more. A corner at threshold t has more than t.
///
/// max over arcs of min over nine: the arcs i-1..i+7 and i..i+8 share the eight pixels i..i+7, so that
/// max(min(eight, p[i-1]), min(eight, p[i+8])) = min(eight, max(p[i-1], p[i+8])), and only the even i are needed.
void score_row(const Pixel* centre, std::ptrdiff_t stride, int n, Pixel* __restrict score) {
  const Pixel *u3 = centre - 3 * stride, *u2 = centre - 2 * stride, *u1 = centre - stride;
  const Pixel *d3 = centre + 3 * stride, *d2 = centre + 2 * stride, *d1 = centre + stride;
  for_each_block(n, [=](int first, auto size) {
    const int end = first + size;
#pragma GCC ivdep
    for (int x = first; x < end; ++x) {
      const Pixel p0 = u3[x], p1 = u3[x + 1], p2 = u2[x + 2], p3 = u1[x + 3], p4 = centre[x + 3], p5 = d1[x + 3],
                  p6 = d2[x + 2], p7 = d3[x + 1], p8 = d3[x], p9 = d3[x - 1], p10 = d2[x - 2], p11 = d1[x - 3],
                  p12 = centre[x - 3], p13 = u1[x - 3], p14 = u2[x - 2], p15 = u3[x - 1];
      const Pixel a0 = lower(p0, p1), a2 = lower(p2, p3), a4 = lower(p4, p5), a6 = lower(p6, p7), a8 = lower(p8, p9),
                  a10 = lower(p10, p11), a12 = lower(p12, p13), a14 = lower(p14, p15);
      const Pixel b0 = lower(a0, a2), b2 = lower(a2, a4), b4 = lower(a4, a6), b6 = lower(a6, a8), b8 = lower(a8, a10),
                  b10 = lower(a10, a12), b12 = lower(a12, a14), b14 = lower(a14, a0);
      Pixel bright = lower(lower(b0, b4), upper(p15, p8));
      bright = upper(bright, lower(lower(b2, b6), upper(p1, p10)));
      bright = upper(bright, lower(lower(b4, b8), upper(p3, p12)));
      bright = upper(bright, lower(lower(b6, b10), upper(p5, p14)));
      bright = upper(bright, lower(lower(b8, b12), upper(p7, p0)));
      bright = upper(bright, lower(lower(b10, b14), upper(p9, p2)));
      bright = upper(bright, lower(lower(b12, b0), upper(p11, p4)));
      bright = upper(bright, lower(lower(b14, b2), upper(p13, p6)));

      const Pixel c0 = upper(p0, p1), c2 = upper(p2, p3), c4 = upper(p4, p5), c6 = upper(p6, p7), c8 = upper(p8, p9),
                  c10 = upper(p10, p11), c12 = upper(p12, p13), c14 = upper(p14, p15);
      const Pixel e0 = upper(c0, c2), e2 = upper(c2, c4), e4 = upper(c4, c6), e6 = upper(c6, c8), e8 = upper(c8, c10),
                  e10 = upper(c10, c12), e12 = upper(c12, c14), e14 = upper(c14, c0);
      Pixel dark = upper(upper(e0, e4), lower(p15, p8));
      dark = lower(dark, upper(upper(e2, e6), lower(p1, p10)));
      dark = lower(dark, upper(upper(e4, e8), lower(p3, p12)));
      dark = lower(dark, upper(upper(e6, e10), lower(p5, p14)));
      dark = lower(dark, upper(upper(e8, e12), lower(p7, p0)));
      dark = lower(dark, upper(upper(e10, e14), lower(p9, p2)));
      dark = lower(dark, upper(upper(e12, e0), lower(p11, p4)));
      dark = lower(dark, upper(upper(e14, e2), lower(p13, p6)));
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
