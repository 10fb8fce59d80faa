#include "semvslam/render/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

namespace semvslam::render {
namespace {

using Byte4 = std::uint8_t __attribute__((vector_size(4)));

inline Colour4 unpack(std::uint32_t texel) {
  Byte4 bytes;
  std::memcpy(&bytes, &texel, 4);
  return __builtin_convertvector(bytes, Colour4);
}

int power_of_two(int n) { return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(n, 1)))); }

}  // namespace

Texture::Texture(const cv::Mat& bgr, bool repeat) : repeat_(repeat) {
  CV_Assert(bgr.type() == CV_8UC3 && !bgr.empty());
  cv::Mat image = bgr;
  const cv::Size size(power_of_two(bgr.cols), power_of_two(bgr.rows));
  if (size != bgr.size()) cv::resize(bgr, image, size, 0, 0, cv::INTER_LINEAR);
  while (true) {
    Level level{image.cols, image.rows, {}};
    level.texels.resize(static_cast<std::size_t>(image.cols) * image.rows);
    for (int y = 0; y < image.rows; ++y) {
      const auto* row = image.ptr<cv::Vec3b>(y);
      for (int x = 0; x < image.cols; ++x) {
        level.texels[static_cast<std::size_t>(y) * image.cols + x] =
            row[x][0] | row[x][1] << 8 | static_cast<std::uint32_t>(row[x][2]) << 16;
      }
    }
    levels_.push_back(std::move(level));
    if (image.cols == 1 && image.rows == 1) break;
    cv::Mat half;
    cv::resize(image, half, {std::max(1, image.cols / 2), std::max(1, image.rows / 2)}, 0, 0, cv::INTER_AREA);
    image = half;
  }
}

inline Colour4 Texture::bilinear(const Level& level, float u, float v) const {
  const float x = u * static_cast<float>(level.width) - 0.5f, y = v * static_cast<float>(level.height) - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  int x0 = static_cast<int>(fx), y0 = static_cast<int>(fy), x1 = x0 + 1, y1 = y0 + 1;
  if (repeat_) {
    x0 &= level.width - 1;
    x1 &= level.width - 1;
    y0 &= level.height - 1;
    y1 &= level.height - 1;
  } else {
    x0 = std::clamp(x0, 0, level.width - 1);
    x1 = std::clamp(x1, 0, level.width - 1);
    y0 = std::clamp(y0, 0, level.height - 1);
    y1 = std::clamp(y1, 0, level.height - 1);
  }
  const float ax = x - fx, ay = y - fy;
  const std::uint32_t* upper = level.texels.data() + static_cast<std::size_t>(y0) * level.width;
  const std::uint32_t* lower = level.texels.data() + static_cast<std::size_t>(y1) * level.width;
  const Colour4 top = unpack(upper[x0]) * (1.f - ax) + unpack(upper[x1]) * ax;
  const Colour4 bottom = unpack(lower[x0]) * (1.f - ax) + unpack(lower[x1]) * ax;
  return top * (1.f - ay) + bottom * ay;
}

Colour4 Texture::sample(float u, float v, float lod) const {
  const int last = static_cast<int>(levels_.size()) - 1;
  if (lod <= 0.f) return bilinear(levels_[0], u, v);
  const int level = static_cast<int>(lod);
  if (level >= last) return unpack(levels_[last].texels[0]);
  const float blend = lod - static_cast<float>(level);
  return bilinear(levels_[level], u, v) * (1.f - blend) + bilinear(levels_[level + 1], u, v) * blend;
}

}  // namespace semvslam::render
