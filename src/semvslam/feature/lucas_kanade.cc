#include "semvslam/feature/lucas_kanade.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <type_traits>

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace semvslam {
namespace {

// Gradients are whole multiples of 1/32 grey level per pixel (32 is the sum of the weights of Scharr's filter, one
// column times the distance of the two): they stay below 2^12.
constexpr double kGradientUnit = 1.0 / 32;
constexpr std::int64_t kMaxGradient = 16 * 255;
constexpr int kMaxWindow = LucasKanadeOptions::kLargestWindowPx;
constexpr int kMaxLanes = patch_lanes(kMaxWindow);
// Sums of grey values times gradients over a whole patch and of squared gradients over a chunk fit 32 bits.
constexpr int kChunk = 112;
static_assert(255 * kMaxGradient * kMaxWindow * kMaxWindow < std::int64_t{1} << 31);
static_assert(kMaxGradient * kMaxGradient * kChunk < std::int64_t{1} << 31);

/// Rows of a patch, each in whole blocks of lanes, with up to three rows more.
using Rows = std::array<std::int16_t, (kMaxWindow + 3) * kMaxLanes>;

/// A patch between pixels: its first whole pixel and the rest of the way, 0 <= rest < 1.
struct Place {
  int x = 0, y = 0;
  float rest_x = 0, rest_y = 0;  // px
};

Place place_of(cv::Point2f centre, int radius) {
  const float x = std::floor(centre.x), y = std::floor(centre.y);
  return {static_cast<int>(x) - radius, static_cast<int>(y) - radius, centre.x - x, centre.y - y};
}

/// @param fraction in 2^-15. |b - a| must stay below 2^15. One instruction more than the sums where there is one for it
/// (pmulhrsw, sqrdmulh).
inline std::int16_t mix(std::int16_t a, std::int16_t b, std::int16_t fraction) {
  const auto difference = static_cast<std::int16_t>(b - a);
  return static_cast<std::int16_t>(a + static_cast<std::int16_t>((((difference * fraction) >> 14) + 1) >> 1));
}

/// From whole pixels (one row more) to the place between them; what is in `rows` is lost.
template <int kLanes>
void interpolate(std::int16_t* __restrict rows, const Place& place, int height, std::int16_t* __restrict out) {
  const int n = height * kLanes;
  const auto fraction = [](float rest) { return static_cast<std::int16_t>(std::min(rest * 32768.f, 32767.f)); };
  const std::int16_t fx = fraction(place.rest_x), fy = fraction(place.rest_y);
  for (int i = 0; i < n + kLanes; ++i) rows[i] = mix(rows[i], rows[i + 1], fx);
  const std::int16_t* below = rows + kLanes;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) out[i] = mix(rows[i], below[i], fy);
}

/// Pixels as 16-bit numbers. GCC 12 makes four instructions of what is one.
inline void widen(const std::uint8_t* from, std::int16_t* to) {
#ifdef __AVX2__
  const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_cvtepu8_epi16(bytes));
#else
  for (int i = 0; i < 16; ++i) to[i] = from[i];
#endif
}

template <int kLanes>
void load(const cv::Mat& image, int left, int top, int height, std::int16_t* out) {
  const auto stride = static_cast<std::ptrdiff_t>(image.step[0]);
  const std::uint8_t* row = image.data + top * stride + left;
  for (int r = 0; r < height; ++r, row += stride)
    for (int i = 0; i < kLanes; i += 16) widen(row + i, out + r * kLanes + i);
}

/// The pixels around a patch: those of its columns and those to their left and right; a row above, two below.
struct Surroundings {
  Rows left, middle, right;
};

template <int kLanes>
void load_surroundings(const cv::Mat& image, int left, int top, int height, Surroundings& out) {
  load<kLanes>(image, left - 1, top - 1, height + 2, out.left.data());
  load<kLanes>(image, left, top - 1, height + 2, out.middle.data());
  load<kLanes>(image, left + 1, top - 1, height + 2, out.right.data());
}

/// Scharr's gradients at whole pixels, `height` rows.
template <int kLanes>
void gradients(const Surroundings& pixels, int height, std::int16_t* __restrict gx, std::int16_t* __restrict gy) {
  const std::int16_t *left = pixels.left.data(), *middle = pixels.middle.data(), *right = pixels.right.data();
  const int n = height * kLanes;
  constexpr int kRow = kLanes, kBelow = 2 * kLanes;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const auto outer_x = static_cast<std::int16_t>((right[i] + right[i + kBelow]) - (left[i] + left[i + kBelow]));
    const auto inner_x = static_cast<std::int16_t>(right[i + kRow] - left[i + kRow]);
    const auto outer_y = static_cast<std::int16_t>((left[i + kBelow] + right[i + kBelow]) - (left[i] + right[i]));
    const auto inner_y = static_cast<std::int16_t>(middle[i + kBelow] - middle[i]);
    gx[i] = static_cast<std::int16_t>(3 * outer_x + 10 * inner_x);
    gy[i] = static_cast<std::int16_t>(3 * outer_y + 10 * inner_y);
  }
}

/// Nothing counts beside the patch.
template <int kLanes>
void clear_beside(std::int16_t* rows, int window) {
  for (int r = 0; r < window; ++r)
    for (int i = window; i < kLanes; ++i) rows[r * kLanes + i] = 0;
}

struct Moments {
  std::int64_t xx = 0, xy = 0, yy = 0;
};

Moments moments(const std::int16_t* gx, const std::int16_t* gy, int n) {
  Moments sum;
  for (int first = 0; first < n; first += kChunk) {
    std::int32_t xx = 0, xy = 0, yy = 0;
    const int end = std::min(n, first + kChunk);
    for (int i = first; i < end; ++i) {
      xx += gx[i] * gx[i];
      xy += gx[i] * gy[i];
      yy += gy[i] * gy[i];
    }
    sum.xx += xx, sum.xy += xy, sum.yy += yy;
  }
  return sum;
}

/// Sums of grey values times the template's gradients as a function of the place between four whole pixels: as bilinear
/// as the interpolated image, s[0] + s[1] x + s[2] y + s[3] x y with 0 <= x, y <= 1.
struct Bilinear {
  std::array<double, 4> s{};

  /// @param sums at left top, right top, left bottom, right bottom
  static Bilinear through(const std::array<std::int32_t, 4>& sums) {
    const auto [a, b, c, d] = sums;
    return {{static_cast<double>(a), static_cast<double>(b) - a, static_cast<double>(c) - a,
             static_cast<double>(a) - b - c + d}};
  }
  double operator()(double x, double y) const { return (s[0] + s[1] * x) + (s[2] + s[3] * x) * y; }
};

/// What is followed: the gradients of a patch of the first image, and the normal equations' parts that do not change:
/// the matrix's inverse times minus one, which makes px of grey levels times gradients, and that image's sums.
struct Template {
  int window = 0;
  Rows gx, gy;
  double inverse_xx = 0, inverse_xy = 0, inverse_yy = 0, sum_x = 0, sum_y = 0;
};

struct Sums {
  Bilinear x, y;
};

/// @param a from the patch's first pixel on, one row more than it has. @param b their neighbours to the right.
template <int kLanes>
Sums correlate(const std::int16_t* a, const std::int16_t* b, const Template& patch) {
  const std::int16_t *gx = patch.gx.data(), *gy = patch.gy.data(), *c = a + kLanes, *d = b + kLanes;
  std::int32_t ax = 0, ay = 0, bx = 0, by = 0, cx = 0, cy = 0, dx = 0, dy = 0;
  const int n = patch.window * kLanes;
  for (int i = 0; i < n; ++i) {
    ax += a[i] * gx[i];
    ay += a[i] * gy[i];
    bx += b[i] * gx[i];
    by += b[i] * gy[i];
    cx += c[i] * gx[i];
    cy += c[i] * gy[i];
    dx += d[i] * gx[i];
    dy += d[i] * gy[i];
  }
  return {Bilinear::through({ax, bx, cx, dx}), Bilinear::through({ay, by, cy, dy})};
}

/// @return false where there is too little texture to follow.
template <int kLanes>
bool prepare(const cv::Mat& image, cv::Point2f at, double least_texture, Template& patch) {
  const Place place = place_of(at, patch.window / 2);
  const int n = patch.window * kLanes;
  Surroundings pixels;
  load_surroundings<kLanes>(image, place.x, place.y, patch.window + 1, pixels);
  Rows whole_x, whole_y;
  gradients<kLanes>(pixels, patch.window + 1, whole_x.data(), whole_y.data());
  whole_x[static_cast<std::size_t>(n + kLanes)] = whole_y[static_cast<std::size_t>(n + kLanes)] =
      0;  // is read, not used
  interpolate<kLanes>(whole_x.data(), place, patch.window, patch.gx.data());
  interpolate<kLanes>(whole_y.data(), place, patch.window, patch.gy.data());
  clear_beside<kLanes>(patch.gx.data(), patch.window);
  clear_beside<kLanes>(patch.gy.data(), patch.window);
  const Moments m = moments(patch.gx.data(), patch.gy.data(), n);
  const auto xx = static_cast<double>(m.xx), xy = static_cast<double>(m.xy), yy = static_cast<double>(m.yy);
  const double smaller = 0.5 * (xx + yy - std::sqrt((xx - yy) * (xx - yy) + 4 * xy * xy));
  const double determinant = xx * yy - xy * xy;
  if (smaller * kGradientUnit * kGradientUnit < least_texture * patch.window * patch.window || determinant <= 0)
    return false;
  const double scale = -1 / (determinant * kGradientUnit);
  patch.inverse_xx = yy * scale;
  patch.inverse_xy = -xy * scale;
  patch.inverse_yy = xx * scale;
  const Sums sums = correlate<kLanes>(pixels.middle.data() + kLanes, pixels.right.data() + kLanes, patch);
  patch.sum_x = sums.x(place.rest_x, place.rest_y);
  patch.sum_y = sums.y(place.rest_x, place.rest_y);
  return true;
}

/// Not so far outside that a patch with its neighbours would leave the margin.
bool is_near(const cv::Mat& image, cv::Point2f p, int radius) {
  const auto room = static_cast<float>(radius + 1);
  return p.x >= -room && p.y >= -room && p.x < static_cast<float>(image.cols) + room - 1 &&
         p.y < static_cast<float>(image.rows) + room - 1;
}

/// Gauss-Newton steps on one level. @return false when the search leaves the image.
template <int kLanes>
bool search(const cv::Mat& image, const Template& patch, const LucasKanadeOptions& options, cv::Point2f& found) {
  constexpr float kSwinging_px = 0.01f;  // two steps that cancel
  const int radius = patch.window / 2;
  const auto epsilon = static_cast<float>(options.epsilon_px);
  Rows pixels, next;
  Place cell;
  Bilinear step_x, step_y;  // from every place of the cell
  cv::Point2f before;
  for (int k = 0; k < options.max_iterations; ++k) {
    if (!is_near(image, found, radius)) return false;
    const Place place = place_of(found, radius);
    if (k == 0 || place.x != cell.x || place.y != cell.y) {
      load<kLanes>(image, place.x, place.y, patch.window + 1, pixels.data());
      load<kLanes>(image, place.x + 1, place.y, patch.window + 1, next.data());
      Sums sums = correlate<kLanes>(pixels.data(), next.data(), patch);
      sums.x.s[0] -= patch.sum_x;
      sums.y.s[0] -= patch.sum_y;
      for (std::size_t i = 0; i < 4; ++i) {
        step_x.s[i] = patch.inverse_xx * sums.x.s[i] + patch.inverse_xy * sums.y.s[i];
        step_y.s[i] = patch.inverse_xy * sums.x.s[i] + patch.inverse_yy * sums.y.s[i];
      }
      cell = place;
    }
    const cv::Point2f step(static_cast<float>(step_x(place.rest_x, place.rest_y)),
                           static_cast<float>(step_y(place.rest_x, place.rest_y)));
    found += step;
    if (step.dot(step) <= epsilon * epsilon) break;
    if (k > 0 && std::abs(step.x + before.x) < kSwinging_px && std::abs(step.y + before.y) < kSwinging_px) {
      found -= 0.5f * step;
      break;
    }
    before = step;
  }
  return true;
}

template <int kLanes>
bool follow(const FlowPyramid& from, const FlowPyramid& to, cv::Point2f at, const LucasKanadeOptions& options,
            cv::Point2f& found) {
  Template patch;
  patch.window = options.window_px;
  for (int level = std::min({options.levels, from.top(), to.top()}); level >= 0; --level) {
    const float scale = 1.f / static_cast<float>(1 << level);
    const cv::Point2f start = at * scale;
    cv::Point2f here = found * scale;
    // Where a level tells nothing the next one may.
    const bool followed = is_near(from.level(level), start, patch.window / 2) &&
                          prepare<kLanes>(from.level(level), start, options.least_texture, patch) &&
                          search<kLanes>(to.level(level), patch, options, here);
    found = here * static_cast<float>(1 << level);
    if (level == 0) return followed;
  }
  return false;
}

/// Grey values between pixels in 1/64 grey level.
template <int kLanes>
void sample(const cv::Mat& image, const Place& place, int height, std::int16_t* __restrict out) {
  Rows whole;
  load<kLanes>(image, place.x, place.y, height + 1, whole.data());
  for (int i = 0; i < (height + 1) * kLanes; ++i) whole[static_cast<std::size_t>(i)] *= 64;
  whole[static_cast<std::size_t>((height + 1) * kLanes)] = 0;  // is read, not used
  interpolate<kLanes>(whole.data(), place, height, out);
}

template <int kLanes>
float difference(const cv::Mat& a, cv::Point2f at_a, const cv::Mat& b, cv::Point2f at_b, int window,
                 bool without_offset) {
  Rows rows_a, rows_b;
  sample<kLanes>(a, place_of(at_a, window / 2), window, rows_a.data());
  sample<kLanes>(b, place_of(at_b, window / 2), window, rows_b.data());
  const int n = window * kLanes;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    rows_a[k] = static_cast<std::int16_t>(rows_a[k] - rows_b[k]);
  }
  clear_beside<kLanes>(rows_a.data(), window);
  std::int32_t mean = 0, sum = 0;
  if (without_offset) {
    for (int i = 0; i < n; ++i) mean += rows_a[static_cast<std::size_t>(i)];
    mean = static_cast<std::int32_t>(std::lround(static_cast<double>(mean) / (window * window)));
  }
  for (int i = 0; i < n; ++i) sum += std::abs(rows_a[static_cast<std::size_t>(i)] - mean);
  sum -= window * (kLanes - window) * std::abs(mean);  // the lanes beside the patch
  return static_cast<float>(sum) / static_cast<float>(64 * window * window);
}

}  // namespace

bool follow_point(const FlowPyramid& from, const FlowPyramid& to, cv::Point2f at, const LucasKanadeOptions& options,
                  cv::Point2f& found) {
  if (options.window_px % 2 == 0 || options.window_px < 3 || options.window_px > kMaxWindow || from.empty() ||
      to.empty() || std::min(from.margin_px(), to.margin_px()) < patch_lanes(options.window_px) + 2)
    throw std::invalid_argument("follow_point: the pyramids do not suit the window");
  switch (patch_lanes(options.window_px)) {
    case 16:
      return follow<16>(from, to, at, options, found);
    case 32:
      return follow<32>(from, to, at, options, found);
    default:
      return follow<48>(from, to, at, options, found);
  }
}

cv::Vec3f mean_texture(const FlowPyramid& pyramid, cv::Point pixel, int radius_px) {
  constexpr int kLanes = 16;
  const int side = 2 * radius_px + 1;
  if (side < 1 || side > 15) throw std::invalid_argument("mean_texture: the radius must be 0..7");
  Surroundings pixels;
  load_surroundings<kLanes>(pyramid.level(0), pixel.x - radius_px, pixel.y - radius_px, side, pixels);
  std::array<std::int16_t, 15 * kLanes> gx, gy;
  gradients<kLanes>(pixels, side, gx.data(), gy.data());
  clear_beside<kLanes>(gx.data(), side);
  clear_beside<kLanes>(gy.data(), side);
  const Moments m = moments(gx.data(), gy.data(), side * kLanes);
  const float scale = static_cast<float>(kGradientUnit * kGradientUnit / (side * side));
  return {static_cast<float>(m.xx) * scale, static_cast<float>(m.xy) * scale, static_cast<float>(m.yy) * scale};
}

float patch_difference(const FlowPyramid& a, cv::Point2f at_a, const FlowPyramid& b, cv::Point2f at_b, int window_px,
                       bool without_offset) {
  if (window_px < 1 || window_px > std::min(kMaxWindow, std::min(a.margin_px(), b.margin_px()) - 2))
    throw std::invalid_argument("patch_difference: the pyramids do not suit the window");
  const auto of = [&](auto lanes) {
    return difference<lanes>(a.level(0), at_a, b.level(0), at_b, window_px, without_offset);
  };
  switch (patch_lanes(window_px)) {
    case 16:
      return of(std::integral_constant<int, 16>{});
    case 32:
      return of(std::integral_constant<int, 32>{});
    default:
      return of(std::integral_constant<int, 48>{});
  }
}

}  // namespace semvslam
