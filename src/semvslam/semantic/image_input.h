#pragma once

#include <opencv2/core.hpp>

#include "semvslam/base/result.h"

namespace semvslam {

/// Any usual image as CV_8UC3 BGR: grey, BGRA (alpha dropped), 16 bit (scaled by 1/256). Errors: empty, another type.
Result<cv::Mat> to_bgr8(const cv::Mat& image);

/// An image fitted into a network's input: at the top left, the rest filled with `pad`.
struct FittedImage {
  cv::Mat image;                   // CV_8UC3, continuous
  float scale_x = 1, scale_y = 1;  // input pixels per image pixel
};

/// @param bgr CV_8UC3. @param target memory to reuse between images.
FittedImage fit_image(const cv::Mat& bgr, cv::Size input, int pad, cv::Mat& target);

}  // namespace semvslam
