#pragma once

#include <Eigen/Core>
#include <optional>

#include "semvslam/feature/matching.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/map/frame_features.h"

namespace semvslam {

/// Where a landmark should appear in an image.
struct LandmarkView {
  Eigen::Vector3d in_camera;  // metres
  Eigen::Vector2d pixel;      // ideal (undistorted)
  int level = 0;              // of the pyramid
};

/// What of a landmark decides on that: position (world, metres), mean direction that it was seen along, distances
/// between which its pyramid levels lie.
struct LandmarkShape {
  const Eigen::Vector3d& position;
  const Eigen::Vector3f& normal;
  float min_distance_m = 0, max_distance_m = 0;
};

/// Where and on which pyramid levels to search a landmark's descriptor. @param radius_px at level 0; grows with the
/// level.
ProjectedQuery query_of(const ObservationModel& model, const LandmarkView& view, double radius_px,
                        const Descriptor& descriptor);

/// Cosine of the angle to a landmark's mean direction within which it still looks as it did: 60 degrees.
inline constexpr double kMinViewCosine = 0.5;

/// A camera that landmarks are looked at from.
class LandmarkViewer {
 public:
  /// @param min_view_cosine of the angle to the landmark's mean direction: seen from farther off it looks different.
  LandmarkViewer(const ObservationModel& model, const SE3& camera_from_world, double min_view_cosine = kMinViewCosine)
      : model_(model),
        camera_from_world_(camera_from_world),
        centre_(camera_from_world.inverse().translation()),
        min_view_cosine_(min_view_cosine) {}

  /// Nothing when it lies behind the camera, outside the image, much nearer or farther than it can be recognised, or is
  /// turned away.
  std::optional<LandmarkView> view(const LandmarkShape& landmark) const;

 private:
  const ObservationModel& model_;
  const SE3 camera_from_world_;
  const Eigen::Vector3d centre_;
  const double min_view_cosine_;
};

}  // namespace semvslam
