#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/base/random.h"
#include "semvslam/motion/motion_check.h"

namespace semvslam::motion_testing {

inline Camera test_camera() {
  Camera camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 525;
  camera.cx_px = 319.5;
  camera.cy_px = 239.5;
  return camera;
}

inline SE3 translation(double x, double y, double z) { return {Eigen::Quaterniond::Identity(), {x, y, z}}; }
inline SE3 rotation(double x_rad, double y_rad, double z_rad) {
  SE3::Tangent xi;
  xi << 0, 0, 0, x_rad, y_rad, z_rad;
  return SE3::exp(xi);
}

/// A point of a synthetic world. It moves with constant velocity; group 0 stands still.
struct WorldPoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  // in the world, which is the first camera's frame
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  int group = 0;
};

/// A room full of points (a back wall with things before it) and whatever is put in, seen by a moving camera, as
/// tracks: the input of MotionCheck without images.
struct TrackWorld {
  Camera camera = test_camera();
  std::vector<WorldPoint> points;
  double pixel_noise_px = 0.3, depth_noise_per_m2 = 0.0015;
  double depth_bend_share = 0;  // of the depth at 3 m, growing with its square, less at the image's middle
  bool depth_measured = true;

  explicit TrackWorld(int room_points = 250, std::uint64_t seed = 1) : random_(seed, "motion.test") {
    for (int i = 0; i < room_points; ++i) {
      const double z = i % 3 == 0 ? random_.uniform(1.5, 3.5) : 4.0;
      add_at({random_.uniform(10, 630), random_.uniform(10, 470)}, z, Eigen::Vector3d::Zero(), 0);
    }
  }

  /// A point seen at that pixel by a camera at the origin.
  void add_at(const Eigen::Vector2d& pixel, double depth_m, const Eigen::Vector3d& velocity_m_s, int group) {
    points.push_back({camera.back_project(pixel, depth_m), velocity_m_s, group});
  }
  /// `count` points in a box of the image.
  void add_thing(const cv::Rect& box, double depth_m, const Eigen::Vector3d& velocity_m_s, int count, int group = 1) {
    for (int i = 0; i < count; ++i)
      add_at({random_.uniform(box.x, box.x + box.width), random_.uniform(box.y, box.y + box.height)},
             depth_m + random_.uniform(-0.05, 0.05), velocity_m_s, group);
  }

  MotionFrame frame_of(int index) const {
    MotionFrame frame;
    frame.id = FrameId(static_cast<std::uint32_t>(index));
    frame.time_s = index / 30.0;
    return frame;
  }

  /// Adds what a camera there sees at frame `index` to the tracks, which start with the first call: track i is point i.
  /// A point that is not seen ends its track for good.
  void see(int index, const SE3& camera_from_world) {
    if (tracks.empty())
      for (std::size_t i = 0; i < points.size(); ++i) tracks.emplace_back(PointTrackId(static_cast<std::uint32_t>(i)));
    groups.resize(tracks.size());
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const WorldPoint& point = points[tracks[i].id().value];
      const Eigen::Vector3d p = camera_from_world * Eigen::Vector3d(point.at + point.velocity_m_s * (index / 30.0));
      groups[i] = point.group;
      if (p.z() < 0.3) {
        groups[i] = -1;
        continue;
      }
      TrackSample sample;
      sample.frame = FrameId(static_cast<std::uint32_t>(index));
      sample.time_s = index / 30.0;
      const Eigen::Vector2d ideal =
          camera.project(p) + Eigen::Vector2d(random_.normal(0, pixel_noise_px), random_.normal(0, pixel_noise_px));
      sample.ideal = ideal.cast<float>();
      sample.pixel = camera.distort(ideal).cast<float>();
      sample.texture = {100, 0, 100};
      if (depth_measured) {
        const double off_centre = (ideal - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm() / 400;
        const double bend = depth_bend_share * p.z() * (p.z() / 3) * off_centre;
        sample.depth_m = static_cast<float>(p.z() + bend + random_.normal(0, depth_noise_per_m2 * p.z() * p.z()));
      }
      if (ideal.x() < 0 || ideal.y() < 0 || ideal.x() > 639 || ideal.y() > 479) groups[i] = -1;
      tracks[i].push(sample);
    }
    // What left the image is no longer followed.
    std::vector<FlowTrack> kept;
    std::vector<int> kept_groups;
    for (std::size_t i = 0; i < tracks.size(); ++i)
      if (groups[i] >= 0) kept.push_back(tracks[i]), kept_groups.push_back(groups[i]);
    tracks = std::move(kept);
    groups = std::move(kept_groups);
  }

  std::vector<FlowTrack> tracks;
  std::vector<int> groups;  // per track

 private:
  Random random_;
};

/// Shares of the verdicts in one group of tracks.
struct Shares {
  double moving = 0, at_rest = 0, unknown = 0;
  int count = 0;
};

inline Shares shares_of(const TrackWorld& world, const MotionCheckResult& result, int group) {
  Shares shares;
  for (std::size_t i = 0; i < world.tracks.size(); ++i) {
    if (world.groups[i] != group) continue;
    ++shares.count;
    shares.moving += result.tracks[i].verdict == MotionVerdict::kMoving;
    shares.at_rest += result.tracks[i].verdict == MotionVerdict::kStatic;
    shares.unknown += result.tracks[i].verdict == MotionVerdict::kUnknown;
  }
  if (shares.count > 0) {
    shares.moving /= shares.count;
    shares.at_rest /= shares.count;
    shares.unknown /= shares.count;
  }
  return shares;
}

}  // namespace semvslam::motion_testing
