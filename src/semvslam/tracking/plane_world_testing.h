#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "semvslam/data/frame.h"

namespace semvslam::testing {

/// The smallest world that a camera can be tracked in: one textured, slanted wall, seen exactly (no noise but grey
/// levels).
class PlaneWorld {
 public:
  /// @param seed of what is on the wall.
  explicit PlaneWorld(std::uint32_t seed = 7) : texture_(kTexturePixels, kTexturePixels, CV_8UC1) {
    std::mt19937 random(seed);
    texture_.setTo(128);
    for (int i = 0; i < 6000; ++i) {  // rectangles of many sizes: corners on every level of the pyramid
      const int size = 3 + static_cast<int>(random() % 40);
      // One draw a line: compilers differ in the order in which they evaluate arguments.
      const int y = static_cast<int>(random() % kTexturePixels);
      const int x = static_cast<int>(random() % kTexturePixels);
      const cv::Rect r(x, y, size, size / 2 + 2);
      texture_(r & cv::Rect(0, 0, kTexturePixels, kTexturePixels)).setTo(static_cast<int>(random() % 256));
    }
    cv::GaussianBlur(texture_, texture_, {}, 0.8);
    camera_.width_px = 320;
    camera_.height_px = 240;
    camera_.fx_px = camera_.fy_px = 260;
    camera_.cx_px = 159.5;
    camera_.cy_px = 119.5;
  }

  const Camera& camera() const { return camera_; }

  /// A gentle sway of some 15 cm and 5 degrees; pose 0 is the identity.
  static SE3 world_from_camera(int frame) {
    const double t = frame / 30.0;
    SE3::Tangent xi;
    xi << 0.3 * t, 0.08 * std::sin(2 * t), 0.1 * std::sin(1.3 * t), 0.05 * std::sin(1.7 * t), -0.10 * t,
        0.04 * std::sin(t);
    return SE3::exp(xi);
  }

  RgbdFrame render(int frame) const { return render(world_from_camera(frame), frame); }

  RgbdFrame render(const SE3& world_from_camera, int frame) const {
    RgbdFrame out;
    out.id = FrameId(static_cast<std::uint32_t>(frame));
    out.stamp = TimeStamp{frame * 33'333'333LL};
    out.gray.create(camera_.height_px, camera_.width_px, CV_8UC1);
    out.depth.create(camera_.height_px, camera_.width_px, CV_32FC1);
    const Eigen::Vector3d normal = Eigen::Vector3d(0.15, 0.1, 1).normalized();  // n . x = kWallDistance
    const Eigen::Matrix3d rotation = world_from_camera.rotation_matrix();
    const Eigen::Vector3d centre = world_from_camera.translation();
    for (int y = 0; y < camera_.height_px; ++y)
      for (int x = 0; x < camera_.width_px; ++x) {
        const Eigen::Vector3d ray = camera_.back_project({static_cast<double>(x), static_cast<double>(y)}, 1.0);
        const double depth = (kWallDistance - normal.dot(centre)) / normal.dot(rotation * ray);
        const Eigen::Vector3d p = rotation * (ray * depth) + centre;
        out.depth.at<float>(y, x) = static_cast<float>(depth);
        out.gray.at<std::uint8_t>(y, x) =
            sample(p.x() * kPixelsPerMetre + kTexturePixels / 2.0, p.y() * kPixelsPerMetre + kTexturePixels / 2.0);
      }
    return out;
  }

 private:
  static constexpr int kTexturePixels = 1024;
  static constexpr double kPixelsPerMetre = 170, kWallDistance = 1.6;

  std::uint8_t sample(double u, double v) const {
    const int x = std::clamp(static_cast<int>(std::floor(u)), 0, kTexturePixels - 2);
    const int y = std::clamp(static_cast<int>(std::floor(v)), 0, kTexturePixels - 2);
    const double a = std::clamp(u - x, 0.0, 1.0), b = std::clamp(v - y, 0.0, 1.0);
    const auto at = [&](int dx, int dy) { return static_cast<double>(texture_.at<std::uint8_t>(y + dy, x + dx)); };
    return static_cast<std::uint8_t>(
        std::lround((1 - b) * ((1 - a) * at(0, 0) + a * at(1, 0)) + b * ((1 - a) * at(0, 1) + a * at(1, 1))));
  }

  cv::Mat texture_;
  Camera camera_;
};

}  // namespace semvslam::testing
