#include "semvslam/semantic/mask_paste.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace semvslam {
namespace {

/// For each pixel of a window along one axis: the padded cell before it and how far it is to the next.
struct Axis {
  std::vector<int> cell;
  std::vector<float> fraction;
};

Axis make_axis(int first, int end, float low, float high, int side) {
  Axis axis;
  axis.cell.resize(static_cast<std::size_t>(end - first));
  axis.fraction.resize(axis.cell.size());
  const float length = std::max(high - low, 1e-3f);
  for (int p = first; p < end; ++p) {
    const float at = (static_cast<float>(p) + 0.5f - low) / length * static_cast<float>(side) - 0.5f;
    const int cell = std::clamp(static_cast<int>(std::floor(at)), -1, side - 1);
    axis.cell[static_cast<std::size_t>(p - first)] = cell + 1;  // of the padded grid
    axis.fraction[static_cast<std::size_t>(p - first)] = std::clamp(at - static_cast<float>(cell), 0.f, 1.f);
  }
  return axis;
}

}  // namespace

PastedMask paste_mask(const float* probabilities, int side, const DetectionBox& box, cv::Size image) {
  const int x0 = std::max(0, static_cast<int>(std::floor(box.x0))),
            y0 = std::max(0, static_cast<int>(std::floor(box.y0)));
  const int x1 = std::min(image.width, static_cast<int>(std::ceil(box.x1)));
  const int y1 = std::min(image.height, static_cast<int>(std::ceil(box.y1)));
  if (x1 <= x0 || y1 <= y0) return {};

  const int padded = side + 2;
  std::vector<float> grid(static_cast<std::size_t>(padded) * padded, 0.f);
  for (int y = 0; y < side; ++y)
    std::copy_n(probabilities + static_cast<std::ptrdiff_t>(y) * side, side,
                &grid[static_cast<std::size_t>((y + 1) * padded + 1)]);

  const Axis xs = make_axis(x0, x1, box.x0, box.x1, side), ys = make_axis(y0, y1, box.y0, box.y1, side);
  PastedMask out{cv::Rect(x0, y0, x1 - x0, y1 - y0), cv::Mat(y1 - y0, x1 - x0, CV_8UC1)};
  std::vector<float> row(static_cast<std::size_t>(padded));
  for (int y = 0; y < out.mask.rows; ++y) {
    const float* upper = &grid[static_cast<std::size_t>(ys.cell[y] * padded)];
    const float fy = ys.fraction[y];
    for (int i = 0; i < padded; ++i) row[i] = upper[i] * (1.f - fy) + upper[i + padded] * fy;
    std::uint8_t* to = out.mask.ptr(y);
    for (int x = 0; x < out.mask.cols; ++x) {
      const float* at = &row[xs.cell[x]];
      to[x] = at[0] * (1.f - xs.fraction[x]) + at[1] * xs.fraction[x] >= 0.5f ? 255 : 0;
    }
  }
  return out;
}

}  // namespace semvslam
