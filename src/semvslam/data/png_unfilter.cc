#include "semvslam/data/png_unfilter.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

#if defined(__SSSE3__) && defined(__SSE4_1__)
#include <immintrin.h>
#define SEMVSLAM_PNG_SIMD 1
#endif

namespace semvslam {
namespace {

void unfilter_up(std::uint8_t* row, const std::uint8_t* above, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) row[i] = static_cast<std::uint8_t>(row[i] + above[i]);
}

/// Sub from byte `begin` on: each byte adds the one a pixel to the left.
template <int kPixel>
void sub_scalar(std::uint8_t* row, std::size_t begin, std::size_t size) {
  for (std::size_t i = std::max<std::size_t>(begin, kPixel); i < size; ++i)
    row[i] = static_cast<std::uint8_t>(row[i] + row[i - kPixel]);
}

#ifdef SEMVSLAM_PNG_SIMD

/// The left neighbours' chain of a Sub row is a running sum: inside 16 bytes it is built by adding the block to itself
/// shifted by 1, 2, 4... pixels; the last pixel of the block before is added to all.
template <int kPixel>
void unfilter_sub(std::uint8_t* row, std::size_t size) {
  constexpr int kBlock = 16 / kPixel * kPixel;  // whole pixels; 15 for RGB
  alignas(16) std::uint8_t last_pixel[16];
  for (int i = 0; i < 16; ++i) last_pixel[i] = static_cast<std::uint8_t>(kBlock - kPixel + i % kPixel);
  const __m128i spread_last = _mm_load_si128(reinterpret_cast<const __m128i*>(last_pixel));
  __m128i carry = _mm_setzero_si128();
  std::size_t i = 0;
  for (; i + 16 <= size; i += kBlock) {
    __m128i v = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + i));
    v = _mm_add_epi8(v, _mm_slli_si128(v, kPixel));
    if constexpr (2 * kPixel < kBlock) v = _mm_add_epi8(v, _mm_slli_si128(v, 2 * kPixel));
    if constexpr (4 * kPixel < kBlock) v = _mm_add_epi8(v, _mm_slli_si128(v, 4 * kPixel));
    if constexpr (8 * kPixel < kBlock) v = _mm_add_epi8(v, _mm_slli_si128(v, 8 * kPixel));
    v = _mm_add_epi8(v, carry);
    carry = _mm_shuffle_epi8(v, spread_last);
    if constexpr (kBlock == 16) {
      _mm_storeu_si128(reinterpret_cast<__m128i*>(row + i), v);
    } else {  // 15 bytes: the sixteenth belongs to the next block
      _mm_storel_epi64(reinterpret_cast<__m128i*>(row + i), v);
      _mm_storel_epi64(reinterpret_cast<__m128i*>(row + i + 7), _mm_srli_si128(v, 7));
    }
  }
  sub_scalar<kPixel>(row, i, size);
}

// A pixel moves between memory and register in whole words: three bytes through the stack would wait for each other.

/// @param wide four bytes may be read: the bytes behind the pixel are then whatever follows it, and do no harm.
template <int kPixel>
__m128i load_pixel(const std::uint8_t* p, bool wide) {
  constexpr int kWide = kPixel == 3 ? 4 : kPixel;
  if (kWide != kPixel && !wide) return _mm_cvtsi32_si128(p[0] | p[1] << 8 | p[2] << 16);
  std::uint32_t bits = 0;
  std::memcpy(&bits, p, kWide);
  return _mm_cvtsi32_si128(static_cast<int>(bits));
}

template <int kPixel>
void store_pixel(std::uint8_t* p, __m128i pixel) {
  const auto bits = static_cast<std::uint32_t>(_mm_cvtsi128_si32(pixel));
  if constexpr (kPixel == 3) {
    const auto low = static_cast<std::uint16_t>(bits);
    std::memcpy(p, &low, 2);
    p[2] = static_cast<std::uint8_t>(bits >> 16);
  } else {
    std::memcpy(p, &bits, kPixel);
  }
}

template <int kPixel>
void unfilter_average(std::uint8_t* row, const std::uint8_t* above, std::size_t size) {
  const __m128i one = _mm_set1_epi8(1);
  __m128i left = _mm_setzero_si128();
  for (std::size_t i = 0; i + kPixel <= size; i += kPixel) {
    const bool wide = i + 4 <= size;
    const __m128i up = load_pixel<kPixel>(above + i, wide);
    // pavgb rounds up, PNG rounds down: take away the low bit of the difference.
    const __m128i mean = _mm_sub_epi8(_mm_avg_epu8(left, up), _mm_and_si128(_mm_xor_si128(left, up), one));
    left = _mm_add_epi8(load_pixel<kPixel>(row + i, wide), mean);
    store_pixel<kPixel>(row + i, left);
  }
}

template <int kPixel>
void unfilter_paeth(std::uint8_t* row, const std::uint8_t* above, std::size_t size) {
  const __m128i zero = _mm_setzero_si128();
  __m128i a = zero, c = zero;  // left and upper left pixel, 16 bits per byte
  for (std::size_t i = 0; i + kPixel <= size; i += kPixel) {
    const bool wide = i + 4 <= size;
    const __m128i b = _mm_unpacklo_epi8(load_pixel<kPixel>(above + i, wide), zero);
    const __m128i x = _mm_unpacklo_epi8(load_pixel<kPixel>(row + i, wide), zero);
    const __m128i b_c = _mm_sub_epi16(b, c), a_c = _mm_sub_epi16(a, c);
    const __m128i pa = _mm_abs_epi16(b_c), pb = _mm_abs_epi16(a_c), pc = _mm_abs_epi16(_mm_add_epi16(b_c, a_c));
    const __m128i least = _mm_min_epi16(pc, _mm_min_epi16(pa, pb));
    const __m128i b_or_c = _mm_blendv_epi8(c, b, _mm_cmpeq_epi16(least, pb));
    const __m128i nearest = _mm_blendv_epi8(b_or_c, a, _mm_cmpeq_epi16(least, pa));
    a = _mm_add_epi8(x, nearest);  // of bytes: the sum wraps at 256, the upper halves stay zero
    c = b;
    store_pixel<kPixel>(row + i, _mm_packus_epi16(a, a));
  }
}

#else

template <int kPixel>
void unfilter_sub(std::uint8_t* row, std::size_t size) {
  sub_scalar<kPixel>(row, 0, size);
}

template <int kPixel>
void unfilter_average(std::uint8_t* row, const std::uint8_t* above, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    const int left = i >= kPixel ? row[i - kPixel] : 0;
    row[i] = static_cast<std::uint8_t>(row[i] + (left + above[i]) / 2);
  }
}

template <int kPixel>
void unfilter_paeth(std::uint8_t* row, const std::uint8_t* above, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    const int a = i >= kPixel ? row[i - kPixel] : 0, b = above[i], c = i >= kPixel ? above[i - kPixel] : 0;
    const int pa = std::abs(b - c), pb = std::abs(a - c), pc = std::abs(a + b - 2 * c);
    row[i] = static_cast<std::uint8_t>(row[i] + (pa <= pb && pa <= pc ? a : pb <= pc ? b : c));
  }
}

#endif

template <int kPixel>
bool unfilter(int filter, std::uint8_t* row, const std::uint8_t* above, std::size_t size) {
  switch (filter) {
    case 0:
      return true;
    case 1:
      unfilter_sub<kPixel>(row, size);
      return true;
    case 2:
      unfilter_up(row, above, size);
      return true;
    case 3:
      unfilter_average<kPixel>(row, above, size);
      return true;
    case 4:
      unfilter_paeth<kPixel>(row, above, size);
      return true;
    default:
      return false;
  }
}

}  // namespace

bool png_unfilter_row(int filter, std::uint8_t* row, const std::uint8_t* above, std::size_t size, int pixel_bytes) {
  switch (pixel_bytes) {
    case 1:
      return unfilter<1>(filter, row, above, size);
    case 2:
      return unfilter<2>(filter, row, above, size);
    case 3:
      return unfilter<3>(filter, row, above, size);
    case 4:
      return unfilter<4>(filter, row, above, size);
    default:
      return false;
  }
}

}  // namespace semvslam
