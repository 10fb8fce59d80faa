#include "semvslam/map/depth_surface.h"

#include <algorithm>

#include "semvslam/geometry/depth_image.h"

namespace semvslam {
namespace {

constexpr int kReach_px = 2;
// Depth and landmarks together are this exact; a thing nearer or farther than that is another surface.
constexpr double kSlack_m = 0.05, kSlackShare = 0.06;

}  // namespace

SurfaceCheck check_surface(const Camera& camera, const cv::Mat& depth, const Eigen::Vector2d& pixel, double depth_m) {
  if (depth.empty()) return SurfaceCheck::kUnknown;
  const Eigen::Vector2d recorded = camera.distortion.is_zero() ? pixel : camera.distort(pixel);
  const int x = cvRound(recorded.x()), y = cvRound(recorded.y());
  if (x < kReach_px || y < kReach_px || x >= depth.cols - kReach_px || y >= depth.rows - kReach_px)
    return SurfaceCheck::kUnknown;
  const auto metres_per_unit = static_cast<float>(1.0 / camera.depth_units_per_m);
  float nearest = 1e9f, farthest = 0.f;
  for (int dy = -kReach_px; dy <= kReach_px; ++dy) {
    for (int dx = -kReach_px; dx <= kReach_px; ++dx) {
      const float d = depth_at_m(depth, metres_per_unit, x + dx, y + dy);
      if (d <= 0.f) continue;
      nearest = std::min(nearest, d);
      farthest = std::max(farthest, d);
    }
  }
  if (farthest <= 0.f) return SurfaceCheck::kUnknown;
  const double slack_m = kSlack_m + kSlackShare * depth_m;
  if (farthest < depth_m - slack_m) return SurfaceCheck::kHidden;
  if (nearest > depth_m + slack_m) return SurfaceCheck::kSeenThrough;
  return nearest > depth_m - slack_m && farthest < depth_m + slack_m ? SurfaceCheck::kFits : SurfaceCheck::kUnknown;
}

}  // namespace semvslam
