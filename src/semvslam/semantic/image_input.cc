#include "semvslam/semantic/image_input.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace semvslam {

Result<cv::Mat> to_bgr8(const cv::Mat& image) {
  if (image.empty()) return Error{ErrorCode::kInvalidInput, "the image to segment is empty"};
  cv::Mat eight = image;
  if (image.depth() == CV_16U) image.convertTo(eight, CV_8U, 1.0 / 256);
  if (eight.depth() != CV_8U) return Error{ErrorCode::kInvalidInput, "the image to segment has neither 8 nor 16 bits"};
  cv::Mat bgr;
  switch (eight.channels()) {
    case 1:
      cv::cvtColor(eight, bgr, cv::COLOR_GRAY2BGR);
      return bgr;
    case 3:
      return eight;
    case 4:
      cv::cvtColor(eight, bgr, cv::COLOR_BGRA2BGR);
      return bgr;
    default:
      return Error{ErrorCode::kInvalidInput, "the image to segment has neither 1, 3 nor 4 channels"};
  }
}

FittedImage fit_image(const cv::Mat& bgr, cv::Size input, int pad, cv::Mat& target) {
  const double f = std::min(static_cast<double>(input.height) / bgr.rows, static_cast<double>(input.width) / bgr.cols);
  const auto fitted = [f](int length, int most) {
    return std::clamp(static_cast<int>(std::nearbyint(length * f)), 1, most);
  };
  const cv::Size size(fitted(bgr.cols, input.width), fitted(bgr.rows, input.height));
  target.create(input, CV_8UC3);
  cv::Mat inside = target(cv::Rect({0, 0}, size));
  cv::resize(bgr, inside, size, 0, 0, f < 0.5 ? cv::INTER_AREA : cv::INTER_LINEAR);
  if (size.width < input.width) target.colRange(size.width, input.width).setTo(cv::Scalar::all(pad));
  if (size.height < input.height) target.rowRange(size.height, input.height).setTo(cv::Scalar::all(pad));
  return {target, static_cast<float>(static_cast<double>(size.width) / bgr.cols),
          static_cast<float>(static_cast<double>(size.height) / bgr.rows)};
}

}  // namespace semvslam
