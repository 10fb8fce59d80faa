#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "semvslam/map/map.h"
#include "semvslam/map/vga_testing.h"

namespace semvslam::testing_support {

/// A small map with everything that a file must keep: a lens, masks, features without depth or landmark, ids with gaps,
/// fused landmarks, one whose descriptor's observation is gone, and numbers with all their bits.
inline Map busy_map(int features = 8) {
  Camera camera = vga();
  camera.distortion = {0.1, -0.02, 0.001, 0.002, 0.003};
  NoiseModel noise;
  noise.pixel_sigma_px = 0.7;
  std::vector<float> scales{1};
  while (scales.size() < 8) scales.push_back(1.2f * scales.back());
  const auto model = std::make_shared<ObservationModel>(camera, noise, scales);
  Map map(model);
  std::mt19937_64 random(4);
  std::uniform_real_distribution<float> share(0.1f, 0.9f);
  const auto add_key_frame = [&](int i) {
    auto f = std::make_shared<FrameFeatures>();
    for (int n = 0; n < features; ++n) {
      f->orb.keypoints.push_back(
          {640 * share(random), 480 * share(random), 30 * share(random), share(random), std::uint8_t(n % 8)});
      f->orb.descriptors.push_back({random(), random(), random(), random()});
    }
    measure(*model, cv::Mat(480, 640, CV_32FC1, cv::Scalar(1.7)), *f);
    f->depth_m[0] = 0;
    if (i == 1) {
      cv::Mat moving = cv::Mat::zeros(480, 640, CV_8UC1);
      moving(cv::Rect(100, 50, 30, 20)).setTo(255);
      moving(cv::Rect(500, 60, 140, 10)).setTo(255);
      f->moving = MaskRuns(moving);
    }
    SE3::Tangent xi;
    xi << 0.1 * i, 0.01, -0.03 * i, 0.02 * i, -0.1 * i, 0.3;
    return map.add_key_frame(FrameId(static_cast<std::uint32_t>(7 * i)), TimeStamp{1'305'031'102'175'304'123 + i},
                             SE3::exp(xi), f);
  };
  std::vector<KeyFrameId> key_frames;
  for (int i = 0; i < 4; ++i) key_frames.push_back(add_key_frame(i));
  const auto position = [&] { return Eigen::Vector3d(share(random), share(random), 2 + share(random)); };
  std::vector<LandmarkId> landmarks;
  for (std::uint32_t n = 1; n < 6; ++n) {
    landmarks.push_back(map.add_landmark(position(), key_frames[0], n));
    for (std::size_t k = 1; k < 4; ++k) map.add_observation(landmarks.back(), key_frames[k], n);
    map.count_visible(landmarks.back(), 9, static_cast<int>(n));
    map.refresh_landmark(landmarks.back());
  }
  map.remove_landmark(landmarks[0]);
  map.fuse_landmarks(map.add_landmark(position(), key_frames[3], 6), landmarks[2]);
  map.remove_observation(landmarks[3], key_frames[0]);
  map.remove_key_frame(key_frames[2], key_frames[1]);
  return map;
}

}  // namespace semvslam::testing_support
