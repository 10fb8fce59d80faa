#pragma once

#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/map.h"
#include "semvslam/map/vga_testing.h"

namespace semvslam::testing_support {

/// A round room with corners all around, each with a descriptor of its own, and a camera in its middle.
class RoundRoom {
 public:
  RoundRoom() {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi), y(-1.2, 1.2), radius(2.5, 3.5);
    for (int i = 0; i < 1500; ++i) {
      const double a = angle(random), r = radius(random);
      corners.push_back({r * std::sin(a), y(random), r * std::cos(a)});
      descriptors.push_back({random(), random(), random(), random()});
    }
  }

  /// The camera, turned by so much of a whole turn.
  static SE3 turned(double turns, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(-2 * std::numbers::pi * turns, Eigen::Vector3d::UnitY()));
    return {turn, -(turn * centre)};
  }

  /// What is seen of the room; so many bits of each descriptor are flipped at random. @param seen receives the corners.
  std::shared_ptr<FrameFeatures> look(const SE3& camera_from_world, std::vector<std::size_t>& seen,
                                      int flipped_bits = 0) {
    auto f = std::make_shared<FrameFeatures>();
    seen.clear();
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Eigen::Vector3d p = camera_from_world * corners[k];
      if (p.z() < 0.5) continue;
      const Eigen::Vector2d pixel = model->camera().project(p);
      if (!model->camera().sees(pixel)) continue;
      Descriptor d = descriptors[k];
      for (int b = 0; b < flipped_bits; ++b) d[noise() % 4] ^= std::uint64_t{1} << noise() % 64;
      f->orb.keypoints.push_back({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 1, 0, 3});
      f->orb.descriptors.push_back(d);
      f->x_px.push_back(static_cast<float>(pixel.x()));
      f->y_px.push_back(static_cast<float>(pixel.y()));
      f->depth_m.push_back(static_cast<float>(p.z()));
      seen.push_back(k);
    }
    f->grid.build(f->x_px, f->y_px, 640, 480);
    return f;
  }

  std::shared_ptr<const ObservationModel> model =
      std::make_shared<ObservationModel>(vga(), NoiseModel{}, level_scales(OrbOptions{}));
  std::vector<Eigen::Vector3d> corners;
  std::vector<Descriptor> descriptors;
  std::mt19937_64 noise{9};
};

/// The map of a camera that turns around in the room and drifts: each key frame knows the landmarks that the one before
/// it saw, with poses that are off by a little more every time.
class DriftingMap {
 public:
  static constexpr int kTurn = 60;  // key frames once around

  static SE3 truth(int i) { return RoundRoom::turned(static_cast<double>(i) / kTurn); }
  /// Along and around the axis of the turn: then every step drifts alike, which is what spreading it evenly undoes.
  static SE3 drift(int i, double total_rad) {
    SE3::Tangent xi;
    xi << 0, total_rad, 0, 0, total_rad, 0;
    return SE3::exp(xi * i / kTurn);
  }

  /// Key frame i. @param drift_rad after a whole turn, also in metres.
  KeyFrameId add(int i, double drift_rad) {
    std::vector<std::size_t> corner_of;
    const auto f = room.look(truth(i), corner_of);
    const SE3 pose = drift(i, drift_rad) * truth(i);
    const KeyFrameId id = map.add_key_frame(FrameId(static_cast<std::uint32_t>(i)), TimeStamp{i}, pose, f);
    std::vector<LandmarkId> seen(room.corners.size());
    for (std::uint32_t n = 0; n < corner_of.size(); ++n) {
      const std::size_t k = corner_of[n];
      if (known_[k].valid())
        map.add_observation(known_[k], id, n);
      else
        known_[k] = map.add_landmark(pose.inverse() * room.model->back_project(*f, n), id, n);
      seen[k] = known_[k];
    }
    known_ = seen;  // what leaves the image is forgotten
    return id;
  }

  double worst_error_m() const {
    double worst = 0;
    for (const auto& [id, key_frame] : map.key_frames())
      worst = std::max(
          worst, (key_frame.camera_from_world * truth(static_cast<int>(key_frame.frame.value)).inverse()).log().norm());
    return worst;
  }

  RoundRoom room;
  Map map{room.model};

 private:
  std::vector<LandmarkId> known_ = std::vector<LandmarkId>(room.corners.size());  // as the newest key frame has them
};

}  // namespace semvslam::testing_support
