#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace semvslam::render {

/// Four floats that the compiler keeps in one register: blue, green, red, unused; display (gamma) values 0..255.
using Colour4 = float __attribute__((vector_size(16)));

/// A colour image with its pyramid of halved copies. Texel i of n covers [i / n, (i + 1) / n) of the coordinate, at
/// every level, so filtering moves nothing.
class Texture {
 public:
  /// @param bgr CV_8UC3; sides are brought to powers of two. Coordinates outside [0, 1) repeat or clamp.
  Texture(const cv::Mat& bgr, bool repeat);

  /// Trilinear. @param u, v 1 = the whole image; @param lod 0 = full size, fractions blend two levels.
  Colour4 sample(float u, float v, float lod) const;

  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }

 private:
  struct Level {
    int width, height;
    // B | G << 8 | R << 16; one column and one row more than the image, so that a texel's right and lower neighbours
    // always follow it (wrapped or repeated).
    std::vector<std::uint32_t> texels;
  };
  Colour4 bilinear(const Level& level, float u, float v) const;

  std::vector<Level> levels_;
  bool repeat_;
};

}  // namespace semvslam::render
