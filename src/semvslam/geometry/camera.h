#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "semvslam/base/result.h"

namespace semvslam {

/// Brown-Conrady distortion, OpenCV's order and meaning: radial k1 k2 k3, tangential p1 p2.
struct BrownDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  bool is_zero() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
};

/// An RGB-D camera: pinhole + Brown distortion of the colour image; depth is registered to colour.
/// Camera frame: x right, y down, z forward. Pixel (0, 0) is the CENTRE of the top left pixel.
struct Camera {
  int width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  BrownDistortion distortion;
  double depth_units_per_m = 5000;  // of 16-bit depth images; 5000 in TUM recordings, 1000 = millimetres
  double baseline_m = 0.075;  // of the structured-light pair behind the depth: its noise grows with depth^2 / (f b)
  double frame_rate_hz = 30;

  /// Point in the camera frame (z > 0) -> ideal (undistorted) pixel.
  Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    return {fx_px * p.x() / p.z() + cx_px, fy_px * p.y() / p.z() + cy_px};
  }
  /// Whether an ideal pixel lies in the image.
  bool sees(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < width_px && pixel.y() < height_px;
  }
  /// Ideal pixel and depth along z -> point in the camera frame.
  Eigen::Vector3d back_project(const Eigen::Vector2d& pixel, double depth_m) const {
    return {(pixel.x() - cx_px) / fx_px * depth_m, (pixel.y() - cy_px) / fy_px * depth_m, depth_m};
  }
  /// Ideal pixel -> where the lens puts it in the recorded image.
  Eigen::Vector2d distort(const Eigen::Vector2d& ideal) const;
  /// Recorded pixel -> ideal pixel: damped Newton iteration; where the lens model has no inverse, the nearest found.
  Eigen::Vector2d undistort(const Eigen::Vector2d& recorded) const;

  /// How far apart this camera and another one of the same size see the same thing at most, pixels: over a grid of
  /// recorded pixels of this one. Infinite where the lens model has no answer.
  double largest_shift_px(const Camera& other) const;

  /// Sizes 16..16384, focal lengths finite and positive, principal point inside the image, depth factor positive.
  Status check() const;
};

}  // namespace semvslam
