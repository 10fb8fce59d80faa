#include "semvslam/dynamic/mover_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace semvslam {
namespace {

constexpr int kPx = CellGrid::kCellPx;
constexpr float kBodyDepthM = 0.6f;   // no part of a thing is farther before or behind its middle
constexpr float kLimbDepthM = 0.3f;   // nor a limb from the place where it leaves the mask
constexpr float kStepShare = 0.025f;  // of the depth: a larger step between neighbours is an edge
constexpr float kEdgeShare = 0.05f;   // the same between any two of the cells around a place
constexpr float kBucketsPerM = 100;   // distances are told apart to a centimetre

struct Front {
  int cell;
  float depth_m;         // last measured on the way
  float origin_depth_m;  // where it left the mask
  float distance_m;
  int hole;  // cells without depth since the last measured one
};

}  // namespace

MoverReach::MoverReach(const Camera& camera, const cv::Mat& depth, double reach_m)
    : grid_(camera, depth),
      fx_px_(camera.fx_px),
      reach_m_(reach_m),
      places_(grid_.size(), Place::kOutside),
      distances_m_(grid_.size(), std::numeric_limits<float>::infinity()) {}

void MoverReach::add(const cv::Rect& window, const cv::Mat& mask, float depth_m) {
  if (mask.empty() || depth_m <= 0) return;
  const int reach_px = cvCeil(std::min(reach_m_ * fx_px_ / depth_m, 1e5));
  movers_.push_back(
      {cv::Rect(window.x - reach_px, window.y - reach_px, window.width + 2 * reach_px, window.height + 2 * reach_px),
       depth_m});
  // The window's cells and a ring about them, where the picture has one.
  const cv::Rect cells = cv::Rect(cv::Point((window.x + kPx - 1) / kPx - 1, (window.y + kPx - 1) / kPx - 1),
                                  cv::Point((window.br().x + kPx - 1) / kPx + 1, (window.br().y + kPx - 1) / kPx + 1)) &
                         cv::Rect(0, 0, grid_.columns, grid_.rows);
  cv::Mat covered = cv::Mat::zeros(cells.size(), CV_8UC1), core;
  for (int r = 0; r < cells.height; ++r)
    for (int c = 0; c < cells.width; ++c)
      if (const cv::Point at((cells.x + c) * kPx, (cells.y + r) * kPx); window.contains(at))
        covered.at<std::uint8_t>(r, c) = mask.at<std::uint8_t>(at - window.tl());
  // The rim of a mask may lie on what is behind it.
  cv::erode(covered, core, cv::Mat(), {-1, -1}, 1, cv::BORDER_REPLICATE);
  for (int r = 0; r < cells.height; ++r)
    for (int c = 0; c < cells.width; ++c) {
      if (covered.at<std::uint8_t>(r, c) == 0) continue;
      const int cell = (cells.y + r) * grid_.columns + cells.x + c;
      const float z = grid_.depth_m[static_cast<std::size_t>(cell)];
      const bool from = core.at<std::uint8_t>(r, c) != 0 && z > 0 && std::abs(z - depth_m) < kBodyDepthM;
      Place& place = places_[static_cast<std::size_t>(cell)];
      if (from && place != Place::kCore) cores_.push_back(cell);
      place = std::max(place, from ? Place::kCore : Place::kInside);
    }
}

void MoverReach::spread() {
  const float cell_share = static_cast<float>(kPx / fx_px_);  // width of a cell, share of its depth
  const auto reach_m = static_cast<float>(reach_m_);
  const CellGrid& grid = grid_;
  const Place* const places = places_.data();
  const float* const depths_m = grid.depth_m.data();
  float* const distances_m = distances_m_.data();
  std::vector<std::vector<Front>> open(static_cast<std::size_t>(reach_m * kBucketsPerM) + 2);
  for (const int cell : cores_) distances_m[cell] = 0;
  const auto go_on = [=, &grid, &open](const Front& at) {
    grid.for_neighbours(at.cell, [&](int cell) {
      if (distances_m[cell] <= at.distance_m) return;
      Front to = at;
      to.cell = cell;
      const bool inside = places[cell] != Place::kOutside;
      const float z = depths_m[cell];
      if (z > 0) {
        if (!CellGrid::goes_on(at.depth_m, z, at.hole, kStepShare)) return;
        if (inside) to.origin_depth_m = z;
        if (std::abs(z - to.origin_depth_m) > kLimbDepthM) return;
        to.depth_m = z;
        to.hole = 0;
      } else if (++to.hole > CellGrid::kLongestHole) {
        return;
      }
      if (!inside) {
        const float across_m = cell_share * to.depth_m, along_m = to.depth_m - at.depth_m;
        to.distance_m += std::sqrt(across_m * across_m + along_m * along_m);
      }
      if (to.distance_m >= distances_m[cell] || to.distance_m > reach_m) return;
      distances_m[cell] = to.distance_m;
      open[static_cast<std::size_t>(to.distance_m * kBucketsPerM)].push_back(to);
    });
  };
  for (const int cell : cores_) {
    const float z = depths_m[cell];
    go_on({cell, z, z, 0, 0});
  }
  for (std::size_t bucket = 0; bucket < open.size(); ++bucket)
    for (std::size_t next = 0; next < open[bucket].size(); ++next) {
      const Front at = open[bucket][next];                   // a copy: the bucket may grow
      if (at.distance_m <= distances_m[at.cell]) go_on(at);  // else a shorter way has been found since
    }
}

bool MoverReach::is_at_edge(const cv::Point2f& pixel) const {
  const int cell = grid_.cell_of(pixel), column = cell % grid_.columns, row = cell / grid_.columns;
  std::vector<float> around;
  around.reserve(9);
  for (int r = std::max(0, row - 1); r <= std::min(grid_.rows - 1, row + 1); ++r)
    for (int c = std::max(0, column - 1); c <= std::min(grid_.columns - 1, column + 1); ++c)
      if (const float z = grid_.depth_m[static_cast<std::size_t>(r * grid_.columns + c)]; z > 0) around.push_back(z);
  const cv::Point place(cvRound(pixel.x), cvRound(pixel.y));
  if (around.empty())
    return std::any_of(movers_.begin(), movers_.end(), [&](const Mover& m) { return m.reach.contains(place); });
  const auto [low, high] = std::minmax_element(around.begin(), around.end());
  if (*high - *low <= kEdgeShare * *high) return false;
  return std::any_of(movers_.begin(), movers_.end(), [&](const Mover& m) {
    return m.reach.contains(place) &&
           std::any_of(around.begin(), around.end(), [&](float z) { return std::abs(z - m.depth_m) < kLimbDepthM; });
  });
}

}  // namespace semvslam
