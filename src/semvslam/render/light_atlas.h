#pragma once

#include <algorithm>
#include <vector>

#include "semvslam/render/texture.h"

namespace semvslam::render {

/// Baked light of all surfaces in one image: display-gamma factors (square roots of radiance), blue green red.
struct LightAtlas {
  int width = 0, height = 0;
  std::vector<Colour4> texels;

  const Colour4& at(int column, int row) const { return texels[static_cast<std::size_t>(row) * width + column]; }
  Colour4& at(int column, int row) { return texels[static_cast<std::size_t>(row) * width + column]; }

  /// Bilinear; (0, 0) = centre of the first texel; clamped at the border.
  Colour4 sample(float column, float row) const {
    column = std::min(std::max(column, 0.f), static_cast<float>(width - 1) - 1e-3f);
    row = std::min(std::max(row, 0.f), static_cast<float>(height - 1) - 1e-3f);
    const int x = static_cast<int>(column), y = static_cast<int>(row);
    const float ax = column - static_cast<float>(x), ay = row - static_cast<float>(y);
    const Colour4* upper = texels.data() + static_cast<std::size_t>(y) * width + x;
    const Colour4* lower = upper + width;
    return (upper[0] * (1.f - ax) + upper[1] * ax) * (1.f - ay) + (lower[0] * (1.f - ax) + lower[1] * ax) * ay;
  }
};

}  // namespace semvslam::render
