#include "semvslam/semantic/detection_boxes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace semvslam {

std::vector<DetectionBox> make_anchors(int rows, int columns, int stride, std::span<const float> sizes,
                                       std::span<const float> ratios) {
  std::vector<DetectionBox> cell;
  for (const float size : sizes)
    for (const float ratio : ratios) {
      const auto w = static_cast<float>(size / std::sqrt(static_cast<double>(ratio)) / 2);
      const auto h = static_cast<float>(size * std::sqrt(static_cast<double>(ratio)) / 2);
      cell.push_back({-w, -h, w, h});
    }
  std::vector<DetectionBox> out;
  out.reserve(static_cast<std::size_t>(rows) * columns * cell.size());
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const float cx = (static_cast<float>(x) + 0.5f) * static_cast<float>(stride);
      const float cy = (static_cast<float>(y) + 0.5f) * static_cast<float>(stride);
      for (const DetectionBox& c : cell) out.push_back({cx + c.x0, cy + c.y0, cx + c.x1, cy + c.y1});
    }
  return out;
}

DetectionBox decode_box(const float* deltas, const DetectionBox& reference, const std::array<float, 4>& weights,
                        float width, float height) {
  static const auto kMostGrowth = static_cast<float>(std::log(1000.0 / 16.0));
  const float rw = reference.width(), rh = reference.height();
  const float cx = (reference.x0 + reference.x1) / 2 + deltas[0] / weights[0] * rw;
  const float cy = (reference.y0 + reference.y1) / 2 + deltas[1] / weights[1] * rh;
  const float w = rw * std::exp(std::min(deltas[2] / weights[2], kMostGrowth));
  const float h = rh * std::exp(std::min(deltas[3] / weights[3], kMostGrowth));
  return {std::clamp(cx - w / 2, 0.f, width), std::clamp(cy - h / 2, 0.f, height), std::clamp(cx + w / 2, 0.f, width),
          std::clamp(cy + h / 2, 0.f, height)};
}

std::vector<int> largest(std::span<const float> values, int most) {
  std::vector<int> order(values.size());
  std::iota(order.begin(), order.end(), 0);
  const auto better = [&](int a, int b) { return values[a] != values[b] ? values[a] > values[b] : a < b; };
  const auto kept = order.begin() + std::min<std::ptrdiff_t>(most, std::ssize(order));
  std::nth_element(order.begin(), kept, order.end(), better);
  order.erase(kept, order.end());
  std::sort(order.begin(), order.end(), better);
  return order;
}

std::vector<int> suppress_overlaps(std::span<const DetectionBox> boxes, std::span<const float> scores, float threshold,
                                   int most) {
  std::vector<int> kept;
  for (const int candidate : largest(scores, static_cast<int>(scores.size()))) {
    if (std::ssize(kept) >= most) break;
    const DetectionBox& a = boxes[candidate];
    const float area = a.width() * a.height();
    const bool free = std::none_of(kept.begin(), kept.end(), [&](int k) {
      const DetectionBox& b = boxes[k];
      const float w = std::min(a.x1, b.x1) - std::max(a.x0, b.x0), h = std::min(a.y1, b.y1) - std::max(a.y0, b.y0);
      if (w <= 0 || h <= 0) return false;
      const float both = w * h;
      return both > threshold * (b.width() * b.height() + area - both);
    });
    if (free) kept.push_back(candidate);
  }
  return kept;
}

}  // namespace semvslam
