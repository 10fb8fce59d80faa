#include "semvslam/semantic/mask_paste.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace semvslam {
namespace {

/// Equally spaced places along one axis: the n-th lies at origin + pitch (n + 0.5), px.
struct Places {
  float origin = 0, pitch = 1;
  int count = 0;
};

/// For each place the cell before it and how far it is to the next.
struct Axis {
  std::vector<int> cell;
  std::vector<float> fraction;
};

/// A place p lies at cells_per_px p + offset, clamped to the cells 0 .. count - 1.
Axis make_axis(const Places& places, float cells_per_px, float offset, int count) {
  Axis axis;
  for (int n = 0; n < places.count; ++n) {
    const float px = places.origin + places.pitch * (static_cast<float>(n) + 0.5f);
    const float at = std::clamp(px * cells_per_px + offset, 0.f, static_cast<float>(count - 1));
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

  void read_row(int y, std::span<float> out) {
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

/// A mask's probabilities, mixed with a hint where there is one, row by row of some places.
class MixedMask {
 public:
  MixedMask(const MaskGrid& grid, const SemanticHint* hint, const Places& xs, const Places& ys)
      : share_(hint ? hint->share : 0.f), hinted_(static_cast<std::size_t>(xs.count)) {
    // A border of zeros around the cells: what lies beyond them is no object.
    const int side = grid.side, padded = side + 2;
    grid_.assign(static_cast<std::size_t>(padded) * padded, 0.f);
    for (int y = 0; y < side; ++y)
      std::copy_n(grid.probabilities + static_cast<std::ptrdiff_t>(y) * side, side,
                  &grid_[static_cast<std::size_t>((y + 1) * padded + 1)]);
    const auto over_box = [&](const Places& places, float low, float high) {
      const float cells_per_px = static_cast<float>(side) / std::max(high - low, 1e-3f);
      return make_axis(places, cells_per_px, 0.5f - low * cells_per_px, padded);
    };
    own_.emplace(grid_.data(), padded, padded, 1, over_box(xs, grid.box.x0, grid.box.x1),
                 over_box(ys, grid.box.y0, grid.box.y1));
    if (hint)
      other_.emplace(hint->data, hint->rows, hint->columns, hint->step,
                     make_axis(xs, hint->cells_per_px_x, -0.5f, hint->columns),
                     make_axis(ys, hint->cells_per_px_y, -0.5f, hint->rows));
  }

  void read_row(int y, std::span<float> out) {
    own_->read_row(y, out);
    if (!other_) return;
    other_->read_row(y, hinted_);
    for (std::size_t x = 0; x < out.size(); ++x) out[x] = (1.f - share_) * out[x] + share_ * hinted_[x];
  }

 private:
  float share_;
  std::vector<float> grid_, hinted_;
  std::optional<Stretched> own_, other_;
};

}  // namespace

PastedMask paste_mask(const MaskGrid& grid, cv::Size image, float threshold, const SemanticHint* hint) {
  const DetectionBox& box = grid.box;
  const int x0 = std::max(0, static_cast<int>(std::floor(box.x0))),
            y0 = std::max(0, static_cast<int>(std::floor(box.y0)));
  const int x1 = std::min(image.width, static_cast<int>(std::ceil(box.x1)));
  const int y1 = std::min(image.height, static_cast<int>(std::ceil(box.y1)));
  if (x1 <= x0 || y1 <= y0) return {};
  MixedMask mixed(grid, hint, {static_cast<float>(x0), 1, x1 - x0}, {static_cast<float>(y0), 1, y1 - y0});
  PastedMask out{cv::Rect(x0, y0, x1 - x0, y1 - y0), cv::Mat(y1 - y0, x1 - x0, CV_8UC1)};
  std::vector<float> p(static_cast<std::size_t>(x1 - x0));
  double sum = 0;
  int inside = 0;
  for (int y = 0; y < out.mask.rows; ++y) {
    mixed.read_row(y, p);
    std::uint8_t* to = out.mask.ptr(y);
    for (std::size_t x = 0; x < p.size(); ++x) {
      const bool in = p[x] >= threshold;
      to[x] = in ? 255 : 0;
      inside += in;
      sum += in ? p[x] : 0.f;
    }
  }
  if (inside > 0) out.certainty = static_cast<float>(sum / inside);
  return out;
}

void sample_mask(const MaskGrid& grid, const DetectionBox& region, int cells, const SemanticHint* hint, float* out) {
  const auto places = [cells](float low, float high) {
    return Places{low, (high - low) / static_cast<float>(cells), cells};
  };
  MixedMask mixed(grid, hint, places(region.x0, region.x1), places(region.y0, region.y1));
  const auto row = static_cast<std::size_t>(cells);
  for (int y = 0; y < cells; ++y) mixed.read_row(y, {out + static_cast<std::size_t>(y) * row, row});
}

float mean_inside(std::span<const float> probabilities, float threshold) {
  double sum = 0;
  int inside = 0;
  for (const float p : probabilities) {
    inside += p >= threshold;
    sum += p >= threshold ? p : 0.f;
  }
  return inside > 0 ? static_cast<float>(sum / inside) : 0.f;
}

void bend_logits(std::span<float> probabilities, float threshold) {
  constexpr float kLeast = 1e-3f;
  const float shift = std::log(threshold / (1 - threshold));
  for (float& p : probabilities) {
    const float inside = std::clamp(p, kLeast, 1 - kLeast);
    p = std::log(inside / (1 - inside)) - shift;
  }
}

}  // namespace semvslam
