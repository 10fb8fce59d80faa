#include "semvslam/render/contact_shadow.h"

#include <algorithm>
#include <cmath>

namespace semvslam::render {
namespace {

constexpr double kReach_m = 1.1;
constexpr double kStrength = 1.25;

double distance_to_patch(const LightPatch& patch, const Eigen::Vector3d& p) {
  const Eigen::Vector3d u = patch.column_step * (patch.columns - 1), v = patch.row_step * (patch.rows - 1),
                        from = p - patch.origin;
  const double a = std::clamp(from.dot(u) / u.squaredNorm(), 0.0, 1.0),
               b = std::clamp(from.dot(v) / v.squaredNorm(), 0.0, 1.0);
  return (from - a * u - b * v).norm();
}

/// The texels of a patch that a ball can reach, as columns first..last (rows likewise).
void reach(int count, double along, double step_norm, int& first, int& last) {
  first = std::max(0, static_cast<int>(std::floor((along - kReach_m) / step_norm)));
  last = std::min(count - 1, static_cast<int>(std::ceil((along + kReach_m) / step_norm)));
}

}  // namespace

void ContactShadow::update(const std::vector<LightPatch>& patches, const std::vector<Occluder>& occluders) {
  for (const std::size_t i : touched_) {
    const LightPatch& patch = patches[i];
    for (int r = 0; r < patch.rows; ++r) {
      for (int c = 0; c < patch.columns; ++c)
        current_.at(patch.column + c, patch.row + r) = baked_.at(patch.column + c, patch.row + r);
    }
  }
  touched_.clear();
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const LightPatch& patch = patches[i];
    bool touched = false;
    for (const Occluder& ball : occluders) {
      const double above = (ball.centre - patch.origin).dot(patch.normal);
      if (above <= 0 || above > kReach_m || distance_to_patch(patch, ball.centre) > kReach_m) continue;
      touched = true;
      const double column_norm = patch.column_step.norm(), row_norm = patch.row_step.norm();
      int c0, c1, r0, r1;
      reach(patch.columns, (ball.centre - patch.origin).dot(patch.column_step) / column_norm, column_norm, c0, c1);
      reach(patch.rows, (ball.centre - patch.origin).dot(patch.row_step) / row_norm, row_norm, r0, r1);
      const double r2 = ball.radius_m * ball.radius_m;
      for (int r = r0; r <= r1; ++r) {
        for (int c = c0; c <= c1; ++c) {
          const Eigen::Vector3d to = ball.centre - patch.position(c, r);
          const double d2 = std::max(to.squaredNorm(), r2);
          const double fade = std::max(0.0, 1 - d2 / (kReach_m * kReach_m));
          const double covered = std::min(0.75, kStrength * above / std::sqrt(d2) * r2 / d2) * fade;
          current_.at(patch.column + c, patch.row + r) *= static_cast<float>(std::sqrt(1 - covered));
        }
      }
    }
    if (touched) touched_.push_back(i);
  }
}

}  // namespace semvslam::render
