#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

#include "semvslam/geometry/se3.h"
#include "semvslam/render/plan_path.h"

namespace semvslam::render {

/// The way of a hand-held camera: a smooth function of time.
class CameraPath {
 public:
  /// @param motion as SceneOptions::motion, already checked.
  CameraPath(const std::string& motion, std::uint64_t seed);

  /// world_from_camera at a time in seconds since the first frame.
  SE3 pose(double time_s) const;

 private:
  struct View {
    Eigen::Vector3d position;
    double yaw_rad, pitch_rad, roll_rad;  // yaw from +x to the left, pitch downwards, roll clockwise
  };
  View planned(double time_s) const;
  View tour(double time_s) const;
  /// Slow, smooth, zero-mean and not periodic in practice: three sinusoids of incommensurable frequencies, in [-1, 1].
  double sway(int channel, double time_s, double frequency_hz) const;
  /// Tremor of a hand that holds a camera: sinusoids of 2.3, 4.7 and 8.1 Hz, about [-1, 1].
  double tremor(int channel, double time_s) const;

  enum class Motion { kXyz, kRpy, kHalfsphere, kStatic, kTour } motion_;
  PlanPath tour_path_;
  Eigen::Vector3d base_, target_;
  std::array<std::array<double, 3>, 6> phases_;
};

}  // namespace semvslam::render
