#include "semvslam/semantic/mask_paste.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace semvslam {
namespace {

/// For each pixel of a window along one axis: the cell before it and how far it is to the next.
struct Axis {
  std::vector<int> cell;
  std::vector<float> fraction;
};

/// Pixel p lies at cells_per_px (p + 0.5) + offset, clamped to the cells 0 .. count - 1.
Axis make_axis(int first, int end, float cells_per_px, float offset, int count) {
  Axis axis;
  for (int p = first; p < end; ++p) {
    const float at =
        std::clamp((static_cast<float>(p) + 0.5f) * cells_per_px + offset, 0.f, static_cast<float>(count - 1));
    const int cell = std::clamp(static_cast<int>(at), 0, std::max(count - 2, 0));
    axis.cell.push_back(cell);
    axis.fraction.push_back(at - static_cast<float>(cell));
  }
  return axis;
}

/// A grid of probabilities read bilinearly, one row of pixels after the other.
class Stretched {
 public:
  Stretched(const float* data, int rows, int columns, int step, Axis xs, Axis ys)
      : data_(data),
        rows_(rows),
        columns_(columns),
        step_(step),
        xs_(std::move(xs)),
        ys_(std::move(ys)),
        row_(static_cast<std::size_t>(columns) + 1) {}

  void read_row(int y, std::vector<float>& out) {
    const float* upper = data_ + static_cast<std::ptrdiff_t>(ys_.cell[y]) * columns_ * step_;
    const float* lower = ys_.cell[y] + 1 < rows_ ? upper + static_cast<std::ptrdiff_t>(columns_) * step_ : upper;
    const float fy = ys_.fraction[y];
    for (int i = 0; i < columns_; ++i)
      row_[i] = upper[static_cast<std::ptrdiff_t>(i) * step_] * (1.f - fy) +
                lower[static_cast<std::ptrdiff_t>(i) * step_] * fy;
    row_[columns_] = row_[columns_ - 1];
    for (std::size_t x = 0; x < xs_.cell.size(); ++x) {
      const float* at = &row_[xs_.cell[x]];
      out[x] = at[0] * (1.f - xs_.fraction[x]) + at[1] * xs_.fraction[x];
    }
  }

 private:
  const float* data_;
  int rows_, columns_, step_;
  Axis xs_, ys_;
  std::vector<float> row_;
};

}  // namespace

PastedMask paste_mask(const float* probabilities, int side, const DetectionBox& box, cv::Size image, float threshold,
                      const SemanticHint* hint) {
  const int x0 = std::max(0, static_cast<int>(std::floor(box.x0))),
            y0 = std::max(0, static_cast<int>(std::floor(box.y0)));
  const int x1 = std::min(image.width, static_cast<int>(std::ceil(box.x1)));
  const int y1 = std::min(image.height, static_cast<int>(std::ceil(box.y1)));
  if (x1 <= x0 || y1 <= y0) return {};

  // A border of zeros around the cells: what lies beyond them is no object.
  const int padded = side + 2;
  std::vector<float> grid(static_cast<std::size_t>(padded) * padded, 0.f);
  for (int y = 0; y < side; ++y)
    std::copy_n(probabilities + static_cast<std::ptrdiff_t>(y) * side, side,
                &grid[static_cast<std::size_t>((y + 1) * padded + 1)]);
  const auto over_box = [&](int first, int end, float low, float high) {
    const float cells_per_px = static_cast<float>(side) / std::max(high - low, 1e-3f);
    return make_axis(first, end, cells_per_px, 0.5f - low * cells_per_px, padded);
  };
  Stretched own(grid.data(), padded, padded, 1, over_box(x0, x1, box.x0, box.x1), over_box(y0, y1, box.y0, box.y1));
  std::optional<Stretched> other;
  if (hint)
    other.emplace(hint->data, hint->rows, hint->columns, hint->step,
                  make_axis(x0, x1, hint->cells_per_px_x, -0.5f, hint->columns),
                  make_axis(y0, y1, hint->cells_per_px_y, -0.5f, hint->rows));

  PastedMask out{cv::Rect(x0, y0, x1 - x0, y1 - y0), cv::Mat(y1 - y0, x1 - x0, CV_8UC1)};
  std::vector<float> p(static_cast<std::size_t>(x1 - x0)), q(p.size());
  const float share = hint ? hint->share : 0.f;
  double sum = 0;
  int inside = 0;
  for (int y = 0; y < out.mask.rows; ++y) {
    own.read_row(y, p);
    if (other) other->read_row(y, q);
    std::uint8_t* to = out.mask.ptr(y);
    for (std::size_t x = 0; x < p.size(); ++x) {
      const float mixed = (1.f - share) * p[x] + share * q[x];
      const bool in = mixed >= threshold;
      to[x] = in ? 255 : 0;
      inside += in;
      sum += in ? mixed : 0.f;
    }
  }
  if (inside > 0) out.certainty = static_cast<float>(sum / inside);
  return out;
}

}  // namespace semvslam
