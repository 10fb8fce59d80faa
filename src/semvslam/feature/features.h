#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace semvslam {

/// 256-bit oriented BRIEF, four words (Rublee et al., ORB, ICCV 2011).
using Descriptor = std::array<std::uint64_t, 4>;

/// Number of differing bits, 0..256.
inline int hamming_distance(const Descriptor& a, const Descriptor& b) {
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
         std::popcount(a[3] ^ b[3]);
}

/// A corner in the recorded image, coordinates of pyramid level 0, pixel (0, 0) = centre of the top left pixel.
struct Keypoint {
  float x_px = 0, y_px = 0;
  float response = 0;
  float angle_rad = 0;     // direction of the patch's intensity centroid, in [0, 2 pi)
  std::uint8_t level = 0;  // pyramid level it was found on; its localisation error grows with scale_factor^level
};

/// What one image yields; entry i of both vectors belongs together.
struct OrbFeatures {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  std::size_t size() const { return keypoints.size(); }
};

}  // namespace semvslam
