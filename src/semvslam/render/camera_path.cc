#include "semvslam/render/camera_path.h"

#include <cmath>

#include "semvslam/render/degree.h"
#include "semvslam/render/random.h"
#include "semvslam/render/room.h"

namespace semvslam::render {
namespace {

constexpr double kTourSpeed_m_s = 0.34;

/// Around the desks, then the great round through both rooms.
std::vector<Eigen::Vector2d> tour_corners() {
  const double west = -3.0, south = kSouthDoor_m, north = kNorthDoor_m, door_side = 2.3, far_room = 4.95;
  return {{west, south}, {door_side, south}, {door_side, north}, {west, north},
          {west, south}, {far_room, south},  {far_room, north},  {west, north}};
}

}  // namespace

CameraPath::CameraPath(const std::string& motion, std::uint64_t seed) : tour_path_(tour_corners(), 0.75) {
  motion_ = motion == "xyz"          ? Motion::kXyz
            : motion == "rpy"        ? Motion::kRpy
            : motion == "halfsphere" ? Motion::kHalfsphere
            : motion == "static"     ? Motion::kStatic
                                     : Motion::kTour;
  RandomStream random(mix64(seed, 5));
  for (auto& channel : phases_) {
    for (double& phase : channel) phase = random.uniform(0, 2 * M_PI);
  }
  base_ = {-0.3 + random.uniform(-0.25, 0.25), -2.42 + random.uniform(-0.06, 0.06), 1.42 + random.uniform(-0.06, 0.08)};
  target_ = {-0.3 + random.uniform(-0.2, 0.2), 0.4, 0.98 + random.uniform(-0.05, 0.08)};
}

double CameraPath::sway(int channel, double time_s, double frequency_hz) const {
  const auto& p = phases_[channel];
  const double w = 2 * M_PI * frequency_hz * time_s;
  return 0.62 * std::sin(w + p[0]) + 0.26 * std::sin(1.618 * w + p[1]) + 0.12 * std::sin(2.718 * w + p[2]);
}

double CameraPath::tremor(int channel, double time_s) const {
  const auto& p = phases_[channel];
  const double w = 2 * M_PI * time_s;
  return 0.5 * std::sin(2.3 * w + p[1]) + 0.3 * std::sin(4.7 * w + p[2]) + 0.2 * std::sin(8.1 * w + p[0]);
}

CameraPath::View CameraPath::tour(double time_s) const {
  // Hesitating and hurrying, never backwards.
  const double along = 0.4 + kTourSpeed_m_s * time_s + 0.45 * (sway(0, time_s, 0.05) - sway(0, 0.0, 0.05));
  const Eigen::Vector2d here = tour_path_.position(along), ahead = tour_path_.position(along + 0.9);
  const double heading = std::atan2(ahead.y() - here.y(), ahead.x() - here.x());
  View view;
  view.position = {here.x(), here.y(), 1.45 + 0.07 * sway(1, time_s, 0.08) + 0.008 * std::sin(2 * M_PI * 1.7 * time_s)};
  view.yaw_rad = heading + kDegree * (8 + 20 * sway(2, time_s, 0.06));
  view.pitch_rad = kDegree * (12 + 7 * sway(3, time_s, 0.07));
  view.roll_rad = kDegree * 3 * sway(4, time_s, 0.11);
  return view;
}

CameraPath::View CameraPath::planned(double time_s) const {
  if (motion_ == Motion::kTour) return tour(time_s);
  View view;
  view.position = base_;
  const Eigen::Vector3d gaze = target_ - base_;
  view.yaw_rad = std::atan2(gaze.y(), gaze.x());
  view.pitch_rad = std::atan2(-gaze.z(), gaze.head<2>().norm());
  view.roll_rad = 0;
  switch (motion_) {
    case Motion::kXyz:
      view.position +=
          Eigen::Vector3d(0.34 * sway(0, time_s, 0.12), 0.20 * sway(1, time_s, 0.15), 0.22 * sway(2, time_s, 0.13));
      view.yaw_rad += kDegree * 2.0 * sway(3, time_s, 0.1);
      view.pitch_rad += kDegree * 2.0 * sway(4, time_s, 0.12);
      break;
    case Motion::kRpy:
      view.position += 0.03 * Eigen::Vector3d(sway(0, time_s, 0.15), sway(1, time_s, 0.17), sway(2, time_s, 0.13));
      view.roll_rad += kDegree * 22 * sway(3, time_s, 0.14);
      view.pitch_rad += kDegree * 12 * sway(4, time_s, 0.16);
      view.yaw_rad += kDegree * 20 * sway(5, time_s, 0.12);
      break;
    case Motion::kHalfsphere: {
      const double azimuth = 70 * kDegree * sway(0, time_s, 0.09), elevation = 38 * kDegree * sway(1, time_s, 0.11);
      view.position += 0.45 * Eigen::Vector3d(std::cos(elevation) * std::sin(azimuth),
                                              1 - std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
      const Eigen::Vector3d towards = target_ - view.position;
      view.yaw_rad = std::atan2(towards.y(), towards.x()) + kDegree * 6 * sway(2, time_s, 0.1);
      view.pitch_rad = std::atan2(-towards.z(), towards.head<2>().norm()) + kDegree * 4 * sway(3, time_s, 0.12);
      view.roll_rad = kDegree * 5 * sway(4, time_s, 0.1);
      break;
    }
    default:
      break;
  }
  return view;
}

SE3 CameraPath::pose(double time_s) const {
  View view = planned(time_s);
  const double amount = motion_ == Motion::kStatic ? 0.6 : 1.0;
  view.position += 0.0012 * amount * Eigen::Vector3d(tremor(0, time_s), tremor(1, time_s), tremor(2, time_s));
  view.yaw_rad += 0.10 * amount * kDegree * tremor(3, time_s);
  view.pitch_rad += 0.10 * amount * kDegree * tremor(4, time_s);
  view.roll_rad += 0.08 * amount * kDegree * tremor(5, time_s);
  const double cp = std::cos(view.pitch_rad), sp = std::sin(view.pitch_rad), cy = std::cos(view.yaw_rad),
               sy = std::sin(view.yaw_rad);
  Eigen::Matrix3d axes;
  axes.col(2) = Eigen::Vector3d(cp * cy, cp * sy, -sp);
  axes.col(0) = Eigen::Vector3d(sy, -cy, 0);
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const Eigen::Matrix3d rolled = axes * Eigen::AngleAxisd(view.roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return {rolled, view.position};
}

}  // namespace semvslam::render
