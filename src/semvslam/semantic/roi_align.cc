#include "semvslam/semantic/roi_align.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace semvslam {
namespace {

/// Where one cell reads along one axis: two samples of two pixels each.
struct Taps {
  std::array<int, 4> at{};
  std::array<float, 4> weight{};
};

std::vector<Taps> make_taps(float low, float high, int size, int cells) {
  std::vector<Taps> out(static_cast<std::size_t>(cells));
  const auto last = static_cast<float>(size - 1);
  for (int cell = 0; cell < cells; ++cell)
    for (int s = 0; s < 2; ++s) {
      const float share = (static_cast<float>(cell * 2 + s) + 0.5f) / static_cast<float>(cells * 2);
      const float where = low + (high - low) * share;
      Taps& taps = out[static_cast<std::size_t>(cell)];
      if (!(where >= -1.f && where <= static_cast<float>(size))) continue;  // weight 0
      const float inside = std::clamp(where, 0.f, last);
      const int first = static_cast<int>(inside);
      const float fraction = inside - static_cast<float>(first);
      taps.at[s * 2] = first;
      taps.at[s * 2 + 1] = std::min(first + 1, size - 1);
      taps.weight[s * 2] = (1.f - fraction) * 0.5f;
      taps.weight[s * 2 + 1] = fraction * 0.5f;
    }
  return out;
}

struct Span {
  int first = 0, end = 0;
};

/// The columns that cells read with any weight.
Span columns_read(const std::vector<Taps>& xs) {
  Span out;
  for (const Taps& x : xs)
    for (int j = 0; j < 4; ++j)
      if (x.weight[j] != 0.f)
        out = {out.end == 0 ? x.at[j] : std::min(out.first, x.at[j]), std::max(out.end, x.at[j] + 1)};
  return out;
}

void add(const float* __restrict from, float weight, int count, float* __restrict to) {
  for (int k = 0; k < count; ++k) to[k] += weight * from[k];
}

}  // namespace

int roi_level(const DetectionBox& box, std::span<const float> thresholds) {
  const float size = std::sqrt(std::max(box.width() * box.height(), 0.f));
  return static_cast<int>(std::count_if(thresholds.begin(), thresholds.end(), [&](float t) { return size >= t; }));
}

void roi_align(const FeatureMap& map, int channels, const DetectionBox& box, int cells, float* out) {
  const float scale = 1.f / static_cast<float>(map.stride);
  const std::vector<Taps> xs = make_taps(box.x0 * scale - 0.5f, box.x1 * scale - 0.5f, map.columns, cells);
  const std::vector<Taps> ys = make_taps(box.y0 * scale - 0.5f, box.y1 * scale - 0.5f, map.rows, cells);
  const Span columns = columns_read(xs);
  const int width = columns.end - columns.first;
  // Four rows are summed over all columns and four columns of that over all cells, or sixteen pixels for each cell.
  if (width < 3 * cells) {
    std::vector<float> row(static_cast<std::size_t>(width) * channels);
    for (const Taps& y : ys) {
      std::fill(row.begin(), row.end(), 0.f);
      for (int i = 0; i < 4; ++i)
        if (y.weight[i] != 0.f)
          add(map.pixel(y.at[i], columns.first, channels), y.weight[i], static_cast<int>(row.size()), row.data());
      for (const Taps& x : xs) {
        std::fill_n(out, channels, 0.f);
        for (int j = 0; j < 4; ++j)
          if (x.weight[j] != 0.f)
            add(row.data() + static_cast<std::ptrdiff_t>(x.at[j] - columns.first) * channels, x.weight[j], channels,
                out);
        out += channels;
      }
    }
    return;
  }
  for (const Taps& y : ys)
    for (const Taps& x : xs) {
      std::fill_n(out, channels, 0.f);
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
          if (const float weight = y.weight[i] * x.weight[j]; weight != 0.f)
            add(map.pixel(y.at[i], x.at[j], channels), weight, channels, out);
      out += channels;
    }
}

}  // namespace semvslam
