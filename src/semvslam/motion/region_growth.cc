#include "semvslam/motion/region_growth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "semvslam/motion/motion_frame.h"

namespace semvslam {
namespace {

// Of the cells without depth a region takes so many: beside a thing there is none in its projector's shadow.
constexpr int kTakenHole = 1;

struct Front {
  int cell;
  float origin_depth_m;  // of the seed that it came from
  float depth_m;         // last measured on the way
  int hole;              // cells without depth since then
  bool ours;
};

// Fronts by cost, which are small whole numbers; those of one cost come out in the order they went in.
class FrontQueue {
 public:
  void push(int cost, const Front& front) {
    if (static_cast<int>(levels_.size()) <= cost) levels_.resize(static_cast<std::size_t>(cost) + 4);
    levels_[static_cast<std::size_t>(cost)].push_back(front);
  }
  bool pop(int& cost, Front& front) {
    while (level_ < levels_.size() && next_ == levels_[level_].size()) ++level_, next_ = 0;
    if (level_ == levels_.size()) return false;
    cost = static_cast<int>(level_);
    front = levels_[level_][next_++];
    return true;
  }

 private:
  std::vector<std::vector<Front>> levels_;
  std::size_t level_ = 0, next_ = 0;
};

// Cells within the margin of a seed, and those between seeds that are near to each other.
cv::Mat allowed_cells(const CellGrid& grid, std::span<const GrowthSeed> seeds, const GrowthLimits& limits) {
  cv::Mat allowed = cv::Mat::zeros(grid.rows, grid.columns, CV_8UC1);
  const int radius = std::max(1, static_cast<int>(std::lround(limits.margin_px / CellGrid::kCellPx)));
  for (const GrowthSeed& seed : seeds) {
    const int cell = grid.cell_of(seed.pixel);
    cv::circle(allowed, {cell % grid.columns, cell / grid.columns}, radius, 255, cv::FILLED);
  }
  const int bridge = static_cast<int>(limits.bridge_px / CellGrid::kCellPx) | 1;
  cv::Mat closed;
  cv::morphologyEx(allowed, closed, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {bridge, bridge}));
  return closed;
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
      depth_m[static_cast<std::size_t>(r * columns + c)] = depth_at_m(depth, unit, x, y);
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
  const cv::Mat allowed = allowed_cells(grid, seeds, limits);
  FrontQueue open;
  const auto start = [&](const GrowthSeed& seed, bool ours) {
    const int cell = grid.cell_of(seed.pixel);
    if (!allowed.data[cell]) return;
    const float depth_m = seed.depth_m > 0 ? seed.depth_m : grid.depth_m[static_cast<std::size_t>(cell)];
    open.push(0, {cell, depth_m, depth_m, 0, ours});
  };
  for (const GrowthSeed& seed : against) start(seed, false);  // first: in doubt a place is at rest
  for (const GrowthSeed& seed : seeds) start(seed, true);
  std::vector<std::uint8_t> done(grid.size(), 0);
  int cost = 0;
  for (Front at{}; open.pop(cost, at);) {
    if (done[static_cast<std::size_t>(at.cell)]) continue;
    done[static_cast<std::size_t>(at.cell)] = 1;
    if (at.ours && at.hole <= kTakenHole) taken.data[at.cell] = 255;
    grid.for_neighbours(at.cell, [&](int next) {
      if (done[static_cast<std::size_t>(next)] || !allowed.data[next]) return;
      const float z = grid.depth_m[static_cast<std::size_t>(next)];
      if (!(z > 0)) {  // holes are crossed, but are twice as far
        if (at.hole < CellGrid::kLongestHole)
          open.push(cost + 2, {next, at.origin_depth_m, at.depth_m, at.hole + 1, at.ours});
        return;
      }
      const float origin = at.origin_depth_m > 0 ? at.origin_depth_m : z, last = at.depth_m > 0 ? at.depth_m : z;
      if (!CellGrid::goes_on(last, z, at.hole, static_cast<float>(limits.step_share))) return;
      if (std::abs(z - origin) > static_cast<float>(limits.reach_m)) return;
      open.push(cost + 1, {next, origin, z, 0, at.ours});
    });
  }
  return taken;
}

}  // namespace semvslam
