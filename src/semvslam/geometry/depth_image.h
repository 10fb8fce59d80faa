#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace semvslam {

/// Depth in metres at an integer pixel; 0 where nothing was measured. (x, y) must lie inside.
/// @param depth CV_16UC1 in units of `metres_per_unit`, or CV_32FC1 in metres, where NaN, infinite and negative values
/// count as not measured.
inline float depth_at_m(const cv::Mat& depth, float metres_per_unit, int x, int y) {
  if (depth.type() == CV_16UC1) return static_cast<float>(depth.at<std::uint16_t>(y, x)) * metres_per_unit;
  const float d = depth.at<float>(y, x);
  return d > 0.f && d < 1e6f ? d : 0.f;  // NaN fails both
}

/// Every second pixel of every second row, as depth_at_m gives them. @param window in pixels of the half-size image,
/// (width + 1) / 2 by (height + 1) / 2, inside it. @return CV_32FC1 of the window's size, m
cv::Mat half_depth_m(const cv::Mat& depth, float metres_per_unit, const cv::Rect& window);

}  // namespace semvslam
