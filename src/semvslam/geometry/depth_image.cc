#include "semvslam/geometry/depth_image.h"

namespace semvslam {

cv::Mat half_depth_m(const cv::Mat& depth, float metres_per_unit, const cv::Rect& window) {
  cv::Mat half(window.size(), CV_32FC1);
  for (int y = 0; y < half.rows; ++y) {
    float* to = half.ptr<float>(y);
    const int from_y = 2 * (window.y + y);
    if (depth.type() == CV_16UC1) {  // apart, for the compiler to take several pixels at a time
      const std::uint16_t* from = depth.ptr<std::uint16_t>(from_y) + 2 * window.x;
      for (int x = 0; x < half.cols; ++x) to[x] = static_cast<float>(from[2 * x]) * metres_per_unit;
    } else {
      for (int x = 0; x < half.cols; ++x) to[x] = depth_at_m(depth, metres_per_unit, 2 * (window.x + x), from_y);
    }
  }
  return half;
}

}  // namespace semvslam
