#pragma once

#include <Eigen/Core>
#include <vector>

namespace semvslam::render {

/// A closed way on the floor plan: straight lines whose corners are rounded by arcs. Parameterised by metres walked.
class PlanPath {
 public:
  /// @param corners in order; the last joins the first. @param radius_m of the arcs; must fit into the sides.
  PlanPath(const std::vector<Eigen::Vector2d>& corners, double radius_m);

  double length_m() const { return length_; }
  /// Any `along_m`; the way repeats.
  Eigen::Vector2d position(double along_m) const;
  /// Direction of walking, radians from +x.
  double heading_rad(double along_m) const;

 private:
  struct Piece {
    double start_m, length_m;
    Eigen::Vector2d from, direction;  // line, or the first point of an arc and the direction there
    double curvature;                 // 1 / m, left positive; 0 = line
  };
  const Piece& piece_at(double& along_m) const;
  std::vector<Piece> pieces_;
  double length_ = 0;
};

}  // namespace semvslam::render
