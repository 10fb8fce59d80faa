#pragma once

#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>

namespace semvslam {

/// Whether the mask is set at the pixel nearest to a recorded position; positions outside count as the border's.
/// @param mask CV_8UC1; empty = set nowhere.
inline bool is_masked(const cv::Mat& mask, cv::Point2f pixel) {
  if (mask.empty()) return false;
  const int x = std::clamp(cvRound(pixel.x), 0, mask.cols - 1), y = std::clamp(cvRound(pixel.y), 0, mask.rows - 1);
  return mask.at<std::uint8_t>(y, x) != 0;
}

}  // namespace semvslam
