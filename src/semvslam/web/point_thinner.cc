#include "semvslam/web/point_thinner.h"

#include <cmath>
#include <numbers>

namespace semvslam {
namespace {

// So that the number of a cell within kFarthest_m fits in the 21 bits that it has in the key.
constexpr double kSmallestCell_m = 1e-3;
constexpr int kKeyBits = 21;

std::uint64_t key_of(const Eigen::Vector3f& position_m, double cell_m) {
  std::uint64_t key = 0;
  for (const float p : position_m) {
    const auto cell = static_cast<std::int64_t>(std::floor(static_cast<double>(p) / cell_m));
    key = key << kKeyBits | (static_cast<std::uint64_t>(cell) & ((std::uint64_t{1} << kKeyBits) - 1));
  }
  return key;
}

bool is_usable(const Eigen::Vector3f& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() <= PointThinner::kFarthest_m;
}

}  // namespace

bool PointThinner::take_cell(const PlyVertex& point) {
  return cell_m_ == 0 || taken_.insert(key_of(point.position_m, cell_m_)).second;
}

void PointThinner::grow_cells() {
  cell_m_ = cell_m_ == 0 ? kSmallestCell_m : cell_m_ * std::numbers::sqrt2;  // on a surface: half the points are left
  taken_.clear();
  std::erase_if(points_, [&](const PlyVertex& point) { return !take_cell(point); });
}

void PointThinner::add(const PlyVertex& point) {
  ++given_;
  if (!is_usable(point.position_m)) {
    ++unusable_;
    return;
  }
  if (!take_cell(point)) return;
  points_.push_back(point);
  while (points_.size() > most_) grow_cells();
}

}  // namespace semvslam
