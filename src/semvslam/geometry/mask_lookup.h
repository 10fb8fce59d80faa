#pragma once

#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>

namespace semvslam {

/// The pixel of an image nearest to a recorded position; of positions outside, the nearest on the border.
inline cv::Point nearest_pixel(const cv::Size& image, const cv::Point2f& position) {
  return {std::clamp(cvRound(position.x), 0, image.width - 1), std::clamp(cvRound(position.y), 0, image.height - 1)};
}

/// Whether the mask is set at the pixel nearest to a recorded position; positions outside count as the border's.
/// @param mask CV_8UC1; empty = set nowhere.
inline bool is_masked(const cv::Mat& mask, cv::Point2f pixel) {
  if (mask.empty()) return false;
  return mask.at<std::uint8_t>(nearest_pixel(mask.size(), pixel)) != 0;
}

}  // namespace semvslam
