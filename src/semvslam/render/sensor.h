#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "semvslam/geometry/camera.h"
#include "semvslam/render/rasterizer.h"

namespace semvslam::render {

/// A structured-light depth camera and a small colour camera, as noise on an exact picture.
///
/// Depth: a disparity f b / z is measured at a laterally disturbed place, with spatially correlated noise, and rounded
/// to 1/8 px (Konolige and Mihelich 2011, "Technical description of Kinect calibration"; noise form of Barron and Malik
/// 2013 and Handa et al. 2014), so that the error in z grows with z^2. No measurement in the projector's shadow (a
/// strip at one side of near things), beyond the range, and by chance on dark or grazing surfaces. Colour: vignetting,
/// shot and read noise with a little correlation between neighbours.
class SensorModel {
 public:
  explicit SensorModel(const Camera& camera);

  /// @return CV_16UC1 in camera units. @param frame_seed different for every frame. Same result for any `threads`.
  cv::Mat measure_depth(const Picture& picture, std::uint64_t frame_seed, int threads) const;
  /// Noise in place on CV_8UC3.
  void disturb_colour(cv::Mat& colour, std::uint64_t frame_seed, int threads) const;

 private:
  Camera camera_;
  std::vector<float> normal_table_;  // standard normal deviates, a power of two of them
  std::vector<float> wave_table_;    // smooth noise in [-1, 1], repeats
  std::vector<float> vignette_;      // per pixel factor
};

}  // namespace semvslam::render
