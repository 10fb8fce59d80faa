#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "semvslam/geometry/camera.h"

namespace semvslam {

/// Where a region starts from, or what holds it back. Recorded pixels.
struct GrowthSeed {
  cv::Point2f pixel;
  float depth_m = 0;  // 0 = unknown
};

struct GrowthLimits {
  double margin_px = 20;      // about each seed
  double bridge_px = 60;      // seeds as near as that are one area with what lies between them
  double reach_m = 0.35;      // in depth, from the seed that a place was reached from
  double step_share = 0.025;  // of the depth: a larger step between neighbours is an edge
};

/// The image on a coarse raster: masks of regions are made there.
struct CellGrid {
  static constexpr int kCellPx = 4;
  int columns = 0, rows = 0;
  std::vector<float> depth_m;  // per cell; 0 = not measured

  CellGrid() = default;
  /// @param depth CV_16UC1 or CV_32FC1, or empty: no depth anywhere.
  CellGrid(const Camera& camera, const cv::Mat& depth);
  std::size_t size() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
  int cell_of(const cv::Point2f& pixel) const;
  /// Calls visit(cell) for those to the right, left, below and above that there are, in this order.
  template <typename Visit>
  void for_neighbours(int cell, Visit&& visit) const {
    const int c = cell % columns, r = cell / columns;
    if (c + 1 < columns) visit(cell + 1);
    if (c > 0) visit(cell - 1);
    if (r + 1 < rows) visit(cell + columns);
    if (r > 0) visit(cell - columns);
  }
  /// Cells without depth that a surface may go on behind.
  static constexpr int kLongestHole = 4;
  /// Whether a surface goes on from one measured cell to the next, `hole` cells without depth farther: a larger step
  /// than `share` of the depth is an edge, but a hole may hide a slope.
  static bool goes_on(float from_m, float to_m, int hole, float share) {
    return std::abs(to_m - from_m) <= share * static_cast<float>(1 + hole) * std::max(to_m, 1.f);
  }
  cv::Point2f centre(int cell) const {
    return {static_cast<float>(cell % columns * kCellPx) + 1.5f, static_cast<float>(cell / columns * kCellPx) + 1.5f};
  }
};

/// Grows a region from the seeds over cells whose depth continues smoothly, within a margin of the seeds and between
/// seeds near each other.
/// Places nearer (along the surface) to one of `against` than to a seed are not taken.
/// @return CV_8UC1, rows x columns of the grid, 255 = taken.
cv::Mat grow_region(const CellGrid& grid, std::span<const GrowthSeed> seeds, std::span<const GrowthSeed> against,
                    const GrowthLimits& limits);

}  // namespace semvslam
