#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "semvslam/web/ply_reader.h"

namespace semvslam {

/// Keeps at most so many of the points that it is given, as evenly spread as they were: one, the first, per cell of a
/// grid whose cells grow as points come. With fewer points all are kept. Memory is that of the points kept.
class PointThinner {
 public:
  static constexpr float kFarthest_m = 1000;  // from the origin, along each axis

  /// @param most at least 1
  explicit PointThinner(std::size_t most) : most_(most) {}
  void add(const PlyVertex& point);

  const std::vector<PlyVertex>& points() const { return points_; }
  /// Side of the grid's cells; 0 = all points were kept.
  double cell_m() const { return cell_m_; }
  std::size_t given() const { return given_; }
  /// Of these: not finite, or farther away than kFarthest_m, where no room is.
  std::size_t unusable() const { return unusable_; }

 private:
  bool take_cell(const PlyVertex& point);
  void grow_cells();

  std::size_t most_;
  std::vector<PlyVertex> points_;
  std::unordered_set<std::uint64_t> taken_;  // cells that have their point
  double cell_m_ = 0;
  std::size_t given_ = 0, unusable_ = 0;
};

}  // namespace semvslam
