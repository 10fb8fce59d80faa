#include "semvslam/motion/region_growth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <queue>

#include "semvslam/motion/motion_frame.h"

namespace semvslam {
namespace {

struct Front {
  float cost;
  int cell;
  float origin_depth_m;  // of the seed that it came from
  float depth_m;         // last measured on the way
  bool ours;
  // Ties are broken by the cell, then against growing: the result does not depend on the order of pushing.
  bool operator>(const Front& other) const {
    if (cost != other.cost) return cost > other.cost;
    if (cell != other.cell) return cell > other.cell;
    return ours > other.ours;
  }
};

// Cells inside the convex hull of the seeds and the margin around it.
cv::Mat allowed_cells(const CellGrid& grid, std::span<const GrowthSeed> seeds, double margin_px) {
  std::vector<cv::Point> points, hull;
  for (const GrowthSeed& seed : seeds) {
    const int cell = grid.cell_of(seed.pixel);
    points.emplace_back(cell % grid.columns, cell / grid.columns);
  }
  cv::convexHull(points, hull);
  cv::Mat allowed = cv::Mat::zeros(grid.rows, grid.columns, CV_8UC1);
  const int thickness = std::max(1, 2 * static_cast<int>(std::lround(margin_px / CellGrid::kCellPx)));
  if (hull.size() > 2) cv::fillConvexPoly(allowed, hull, 255);
  cv::polylines(allowed, hull, true, 255, thickness);
  return allowed;
}

}  // namespace

CellGrid::CellGrid(const Camera& camera, const cv::Mat& depth)
    : columns((camera.width_px + kCellPx - 1) / kCellPx), rows((camera.height_px + kCellPx - 1) / kCellPx) {
  depth_m.assign(size(), 0.f);
  if (depth.empty()) return;
  const float unit = static_cast<float>(1 / camera.depth_units_per_m);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const int x = std::min(c * kCellPx + 1, depth.cols - 1), y = std::min(r * kCellPx + 1, depth.rows - 1);
      depth_m[static_cast<std::size_t>(r * columns + c)] = motion_depth_m(depth, unit, x, y);
    }
}

int CellGrid::cell_of(const cv::Point2f& pixel) const {
  const int c = std::clamp(static_cast<int>((pixel.x + 0.5f) / kCellPx), 0, columns - 1);
  const int r = std::clamp(static_cast<int>((pixel.y + 0.5f) / kCellPx), 0, rows - 1);
  return r * columns + c;
}

cv::Mat grow_region(const CellGrid& grid, std::span<const GrowthSeed> seeds, std::span<const GrowthSeed> against,
                    const GrowthLimits& limits) {
  cv::Mat taken = cv::Mat::zeros(grid.rows, grid.columns, CV_8UC1);
  if (seeds.empty() || grid.size() == 0) return taken;
  const cv::Mat allowed = allowed_cells(grid, seeds, limits.margin_px);
  std::priority_queue<Front, std::vector<Front>, std::greater<>> open;
  const auto start = [&](const GrowthSeed& seed, bool ours) {
    const int cell = grid.cell_of(seed.pixel);
    if (!allowed.data[cell]) return;
    const float depth_m = seed.depth_m > 0 ? seed.depth_m : grid.depth_m[static_cast<std::size_t>(cell)];
    open.push({0, cell, depth_m, depth_m, ours});
  };
  for (const GrowthSeed& seed : seeds) start(seed, true);
  for (const GrowthSeed& seed : against) start(seed, false);
  std::vector<std::uint8_t> done(grid.size(), 0);
  while (!open.empty()) {
    const Front at = open.top();
    open.pop();
    if (done[static_cast<std::size_t>(at.cell)]) continue;
    done[static_cast<std::size_t>(at.cell)] = 1;
    if (at.ours) taken.data[at.cell] = 255;
    const int c = at.cell % grid.columns, r = at.cell / grid.columns;
    for (const auto& [dc, dr] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      if (c + dc < 0 || r + dr < 0 || c + dc >= grid.columns || r + dr >= grid.rows) continue;
      const int next = at.cell + dr * grid.columns + dc;
      if (done[static_cast<std::size_t>(next)] || !allowed.data[next]) continue;
      const float z = grid.depth_m[static_cast<std::size_t>(next)];
      if (!(z > 0)) {  // holes are crossed, but are twice as far
        open.push({at.cost + 2, next, at.origin_depth_m, at.depth_m, at.ours});
        continue;
      }
      const float origin = at.origin_depth_m > 0 ? at.origin_depth_m : z, last = at.depth_m > 0 ? at.depth_m : z;
      if (std::abs(z - last) > static_cast<float>(limits.step_share) * std::max(z, 1.f)) continue;
      if (std::abs(z - origin) > static_cast<float>(limits.reach_m)) continue;
      open.push({at.cost + 1, next, origin, z, at.ours});
    }
  }
  return taken;
}

}  // namespace semvslam
