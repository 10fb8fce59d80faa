#include "semvslam/render/plan_path.h"

#include <algorithm>
#include <cmath>

namespace semvslam::render {

PlanPath::PlanPath(const std::vector<Eigen::Vector2d>& corners, double radius_m) {
  const int n = static_cast<int>(corners.size());
  auto corner = [&](int i) -> const Eigen::Vector2d& { return corners[((i % n) + n) % n]; };
  auto turn_of = [&](int i) {  // left positive
    const Eigen::Vector2d in = (corner(i) - corner(i - 1)).normalized(), out = (corner(i + 1) - corner(i)).normalized();
    return std::atan2(in.x() * out.y() - in.y() * out.x(), in.dot(out));
  };
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d direction = (corner(i + 1) - corner(i)).normalized();
    const double side = (corner(i + 1) - corner(i)).norm();
    const double cut_here = radius_m * std::tan(std::abs(turn_of(i)) / 2);
    const double turn = turn_of(i + 1), cut_there = radius_m * std::tan(std::abs(turn) / 2);
    const double straight = std::max(1e-6, side - cut_here - cut_there);
    pieces_.push_back({length_, straight, corner(i) + direction * cut_here, direction, 0.0});
    length_ += straight;
    if (std::abs(turn) < 1e-6) continue;
    pieces_.push_back({length_, radius_m * std::abs(turn), corner(i + 1) - direction * cut_there, direction,
                       (turn > 0 ? 1 : -1) / radius_m});
    length_ += pieces_.back().length_m;
  }
}

const PlanPath::Piece& PlanPath::piece_at(double& along_m) const {
  along_m = std::fmod(along_m, length_);
  if (along_m < 0) along_m += length_;
  auto after = std::upper_bound(pieces_.begin(), pieces_.end(), along_m,
                                [](double value, const Piece& piece) { return value < piece.start_m; });
  const Piece& piece = *std::prev(after);
  along_m -= piece.start_m;
  return piece;
}

Eigen::Vector2d PlanPath::position(double along_m) const {
  const Piece& piece = piece_at(along_m);
  if (piece.curvature == 0) return piece.from + piece.direction * along_m;
  const Eigen::Vector2d left(-piece.direction.y(), piece.direction.x());
  const double angle = along_m * piece.curvature;
  return piece.from + (piece.direction * std::sin(angle) + left * (1 - std::cos(angle))) / piece.curvature;
}

double PlanPath::heading_rad(double along_m) const {
  const Piece& piece = piece_at(along_m);
  return std::atan2(piece.direction.y(), piece.direction.x()) + along_m * piece.curvature;
}

}  // namespace semvslam::render
