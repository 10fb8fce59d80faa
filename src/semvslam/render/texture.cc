#include "semvslam/render/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

namespace semvslam::render {
namespace {

using Byte4 = std::uint8_t __attribute__((vector_size(4)));
using Byte8 = std::uint8_t __attribute__((vector_size(8)));
using Float8 = float __attribute__((vector_size(32)));

inline Colour4 unpack(std::uint32_t texel) {
  Byte4 bytes;
  std::memcpy(&bytes, &texel, 4);
  return __builtin_convertvector(bytes, Colour4);
}

inline Float8 unpack_pair(const std::uint32_t* texels) {
  Byte8 bytes;
  std::memcpy(&bytes, texels, 8);
  return __builtin_convertvector(bytes, Float8);
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
    level.texels.reserve(static_cast<std::size_t>(image.cols + 1) * (image.rows + 1));
    for (int y = 0; y <= image.rows; ++y) {
      const auto* row = image.ptr<cv::Vec3b>(y < image.rows ? y : repeat ? 0 : image.rows - 1);
      for (int x = 0; x <= image.cols; ++x) {
        const cv::Vec3b& c = row[x < image.cols ? x : repeat ? 0 : image.cols - 1];
        level.texels.push_back(c[0] | c[1] << 8 | static_cast<std::uint32_t>(c[2]) << 16);
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
  float x = u * static_cast<float>(level.width) - 0.5f, y = v * static_cast<float>(level.height) - 0.5f;
  if (!repeat_) {
    x = std::min(std::max(x, 0.f), static_cast<float>(level.width - 1));
    y = std::min(std::max(y, 0.f), static_cast<float>(level.height - 1));
  }
  const float fx = std::floor(x), fy = std::floor(y);
  const int x0 = static_cast<int>(fx) & (level.width - 1), y0 = static_cast<int>(fy) & (level.height - 1);
  const float ax = x - fx, ay = y - fy;
  const int stride = level.width + 1;
  const std::uint32_t* upper = level.texels.data() + static_cast<std::size_t>(y0) * stride + x0;
  const Float8 columns = unpack_pair(upper) * (1.f - ay) + unpack_pair(upper + stride) * ay;
  const Colour4 left = __builtin_shufflevector(columns, columns, 0, 1, 2, 3);
  const Colour4 right = __builtin_shufflevector(columns, columns, 4, 5, 6, 7);
  return left * (1.f - ax) + right * ax;
}

Colour4 Texture::sample(float u, float v, float lod) const {
  const int last = static_cast<int>(levels_.size()) - 1;
  if (lod <= 0.f) return bilinear(levels_[0], u, v);
  const int level = static_cast<int>(lod);
  if (level >= last) return unpack(levels_[last].texels[0]);
  // Blends only in the middle half between two levels: as smooth to the eye, and half of the pixels read one level.
  const float blend = 2.f * (lod - static_cast<float>(level)) - 0.5f;
  if (blend <= 0.f) return bilinear(levels_[level], u, v);
  if (blend >= 1.f) return bilinear(levels_[level + 1], u, v);
  return bilinear(levels_[level], u, v) * (1.f - blend) + bilinear(levels_[level + 1], u, v) * blend;
}

}  // namespace semvslam::render
