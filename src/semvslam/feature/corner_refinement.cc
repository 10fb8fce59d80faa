#include "semvslam/feature/corner_refinement.h"

#include <algorithm>
#include <array>
#include <cstring>

// Vectors wider than the target's registers are passed in another way than with wider ones: of no matter within one
// file.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace semvslam {
namespace {

constexpr int kLanes = 16;
constexpr int kSize = 2 * (kRefineReach + 1) + 1;  // scores computed, in x and y: where it may go and their neighbours
constexpr int kProducts = kSize + 4;               // rows of gradient products below the window

/// Vectors of the compiler (GCC, clang), one result on every machine: integers up to the score, then separate
/// roundings.
using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));
using Floats = float __attribute__((vector_size(4 * kLanes)));

Ints load(const std::int32_t* from) {
  Ints v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

/// Sums of three neighbours of sums of three neighbours: the window (1 2 3 2 1) in both directions. The last four lanes
/// say nothing.
void sum_windows(const std::array<std::array<std::int32_t, kLanes>, kProducts>& products,
                 std::array<Ints, kSize>& sums) {
  std::array<Ints, kProducts - 2> three;
  for (std::size_t r = 0; r < three.size(); ++r)
    three[r] = load(products[r].data()) + load(products[r + 1].data()) + load(products[r + 2].data());
  // Neighbouring lanes are read from memory: GCC 12 moves the lanes of vectors wider than a register one at a time. All
  // rows are written before the first is read, since a read across two writes waits until they are done.
  alignas(64) std::array<std::int32_t, kSize * kLanes + kLanes> columns{};
  for (std::size_t r = 0; r < sums.size(); ++r) {
    const Ints column = three[r] + three[r + 1] + three[r + 2];
    std::memcpy(&columns[r * kLanes], &column, sizeof column);
  }
  for (std::size_t r = 0; r < sums.size(); ++r) {
    const std::int32_t* row = &columns[r * kLanes];
    const Ints middle = load(row + 2), inner = load(row + 1) + load(row + 3), outer = load(row) + load(row + 4);
    sums[r] = outer + inner + inner + middle + middle + middle;
  }
}

/// Row r, lane c: score of pixel (c - kCentreLane, r - kCentreRow) from the corner.
using Scores = std::array<std::array<float, kLanes>, kSize>;
constexpr int kCentreRow = kSize / 2;
constexpr int kFirstColumn = -kLanes / 2;
constexpr int kCentreLane = -kFirstColumn - 2;  // a window's sum stands in the lane of its first column

void harris_scores(const std::uint8_t* corner, std::ptrdiff_t stride, Scores& scores) {
  // Plain loops here: GCC 12 converts vectors of bytes one lane at a time, but loops over bytes in whole registers.
  alignas(64) std::array<std::array<std::int32_t, kLanes>, kProducts> xx, xy, yy;
  for (int r = 0; r < kProducts; ++r) {
    const std::uint8_t* row = corner + (r - kProducts / 2) * stride + kFirstColumn;
    const auto i = static_cast<std::size_t>(r);
#pragma GCC ivdep
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto gx = static_cast<std::int16_t>(row[lane + 1] - row[lane - 1]);
      const auto gy = static_cast<std::int16_t>(row[lane + stride] - row[lane - stride]);
      const auto c = static_cast<std::size_t>(lane);
      xx[i][c] = gx * gx;
      xy[i][c] = gx * gy;
      yy[i][c] = gy * gy;
    }
  }
  std::array<Ints, kSize> a, b, c;
  sum_windows(xx, a);
  sum_windows(xy, b);
  sum_windows(yy, c);
  for (std::size_t r = 0; r < scores.size(); ++r) {
    const Floats fa = __builtin_convertvector(a[r], Floats), fb = __builtin_convertvector(b[r], Floats),
                 fc = __builtin_convertvector(c[r], Floats);
    const Floats trace = fa + fc;
    const Floats score = fa * fc - fb * fb - 0.04f * (trace * trace);
    std::memcpy(scores[r].data(), &score, sizeof score);
  }
}

}  // namespace

RefinedCorner refine_corner(const cv::Mat& image, int x, int y, const cv::Rect& inside) {
  Scores scores;
  harris_scores(image.ptr<std::uint8_t>(y) + x, static_cast<std::ptrdiff_t>(image.step[0]), scores);
  const auto at = [&](int px, int py) {
    return scores[static_cast<std::size_t>(py - y + kCentreRow)][static_cast<std::size_t>(px - x + kCentreLane)];
  };
  RefinedCorner corner{x, y, 0, 0};
  for (int step = 0; step < kRefineReach; ++step) {
    int to_x = corner.x, to_y = corner.y;
    for (int py = std::max(corner.y - 1, inside.y); py <= std::min(corner.y + 1, inside.br().y - 1); ++py) {
      for (int px = std::max(corner.x - 1, inside.x); px <= std::min(corner.x + 1, inside.br().x - 1); ++px) {
        if (at(px, py) > at(to_x, to_y)) {
          to_x = px;
          to_y = py;
        }
      }
    }
    if (to_x == corner.x && to_y == corner.y) break;
    corner.x = to_x;
    corner.y = to_y;
  }
  // Paraboloid with the second differences of the 3x3 scores; its top where the gradient vanishes.
  const int u = corner.x, v = corner.y;
  const float gx = 0.5f * (at(u + 1, v) - at(u - 1, v)), gy = 0.5f * (at(u, v + 1) - at(u, v - 1));
  const float hxx = at(u + 1, v) - 2 * at(u, v) + at(u - 1, v), hyy = at(u, v + 1) - 2 * at(u, v) + at(u, v - 1);
  const float hxy = 0.25f * (at(u + 1, v + 1) - at(u - 1, v + 1) - at(u + 1, v - 1) + at(u - 1, v - 1));
  const float determinant = hxx * hyy - hxy * hxy;
  if (hxx < 0 && determinant > 0) {
    constexpr float kLimit_px = 0.6f;  // beyond, another pixel would be the peak: flat or noisy scores
    corner.dx_px = std::clamp((hxy * gy - hyy * gx) / determinant, -kLimit_px, kLimit_px);
    corner.dy_px = std::clamp((hxy * gx - hxx * gy) / determinant, -kLimit_px, kLimit_px);
  }
  return corner;
}

}  // namespace semvslam
