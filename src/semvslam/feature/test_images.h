#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace semvslam {

/// Rectangles of random grey on each other: corners of every contrast and size. For tests only.
inline cv::Mat rectangles_image(int width, int height, int seed = 1, int largest_px = 40) {
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  cv::RNG random(static_cast<std::uint64_t>(seed));
  const int count = 4 * width * height / (largest_px * largest_px) + 4;
  for (int i = 0; i < count; ++i) {
    // One draw a line: compilers differ in the order in which they evaluate arguments.
    const int h = random.uniform(4, largest_px);
    const int w = random.uniform(4, largest_px);
    const int y = random.uniform(-10, height);
    const int x = random.uniform(-10, width);
    cv::rectangle(image, cv::Rect(x, y, w, h), cv::Scalar(random.uniform(0, 256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, cv::Size(), 0.8);
  return image;
}

/// Adds Gaussian noise of a standard deviation in grey levels.
inline cv::Mat with_noise(const cv::Mat& image, double sigma, int seed) {
  cv::Mat sum, noise(image.size(), CV_16SC1);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0, sigma);
  image.convertTo(sum, CV_16S);
  sum += noise;
  sum.convertTo(sum, CV_8U);
  return sum;
}

/// Grey 40 with a brighter Gaussian dot around each centre (continuous pixel coordinates).
inline cv::Mat dots_image(int width, int height, const std::vector<cv::Point2d>& centres, double sigma_px) {
  cv::Mat image(height, width, CV_64FC1, cv::Scalar(40));
  const int reach = static_cast<int>(std::ceil(5 * sigma_px));
  for (const cv::Point2d& c : centres) {
    for (int y = std::max(0, cvRound(c.y) - reach); y <= std::min(height - 1, cvRound(c.y) + reach); ++y) {
      for (int x = std::max(0, cvRound(c.x) - reach); x <= std::min(width - 1, cvRound(c.x) + reach); ++x) {
        const double r2 = (x - c.x) * (x - c.x) + (y - c.y) * (y - c.y);
        image.at<double>(y, x) += 180 * std::exp(-r2 / (2 * sigma_px * sigma_px));
      }
    }
  }
  cv::Mat rounded;
  image.convertTo(rounded, CV_8U);
  return rounded;
}

}  // namespace semvslam
