#include "semvslam/feature/pyramid_filters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "semvslam/feature/test_images.h"

namespace semvslam {
namespace {

cv::Mat shrunk(const cv::Mat& image, int width, int height) {
  cv::Mat small(height, width, CV_8UC1);
  Shrinker().shrink(image, small);
  return small;
}

TEST(Shrinker, AgreesWithOpenCVWithinItsRounding) {
  const cv::Mat image = rectangles_image(331, 247, 4, 30);
  for (const cv::Size size :
       {cv::Size(276, 206), cv::Size(331, 247), cv::Size(330, 100), cv::Size(90, 63), cv::Size(83, 247)}) {
    cv::Mat expected, difference;
    cv::resize(image, expected, size, 0, 0, cv::INTER_LINEAR);
    cv::absdiff(expected, shrunk(image, size.width, size.height), difference);
    // Weights of 1/64 against 1/2048: up to 255/128 in each direction, and two roundings.
    EXPECT_LE(*std::max_element(difference.begin<std::uint8_t>(), difference.end<std::uint8_t>()), 4) << size;
    EXPECT_LT(cv::mean(difference)[0], 0.5) << size;
  }
}

TEST(Shrinker, KeepsALinearRampWhereTheConventionPutsIt) {
  cv::Mat ramp(64, 250, CV_8UC1);
  for (int x = 0; x < ramp.cols; ++x) ramp.col(x).setTo(x);
  const cv::Mat small = shrunk(ramp, 208, 53);
  for (int x = 1; x < small.cols - 1; ++x) {
    EXPECT_NEAR(small.at<std::uint8_t>(20, x), (x + 0.5) * 250 / 208 - 0.5, 0.51) << x;
  }
}

TEST(Shrinker, EveryWidthGivesTheSameAsOnePixelAtATime) {
  const cv::Mat image = rectangles_image(300, 40, 5);
  for (int width = 90; width <= 300; width += 7) {
    const cv::Mat small = shrunk(image, width, 40);
    for (int x = 0; x < width; ++x) {
      const long at = std::clamp(std::lround(((x + 0.5) * 300 / width - 0.5) * 64), 0l, 299l * 64);
      const long left = std::min(at / 64, 298l), second = at - left * 64;
      const auto* row = image.ptr<std::uint8_t>(7);
      ASSERT_EQ(small.at<std::uint8_t>(7, x), (row[left] * (64 - second) + row[left + 1] * second + 32) / 64)
          << width << " " << x;
    }
  }
}

TEST(Shrinker, RefusesToEnlarge) {
  cv::Mat large(50, 50, CV_8UC1);
  EXPECT_THROW(Shrinker().shrink(rectangles_image(49, 60), large), std::invalid_argument);
}

TEST(Smoother, HasTheWeightsItPromises) {
  // One bright pixel on a grey ground: its spread is the product of the two triangles, up to the upward roundings.
  const int height = 21;
  for (const int width : {21, 64, 67, 70, 71, 150}) {
    cv::Mat image(height, width, CV_8UC1, cv::Scalar(0)), out(height, width, CV_8UC1, cv::Scalar(0));
    const cv::Point centre(width / 2, 10);
    image.at<std::uint8_t>(centre) = 255;
    Smoother().smooth(image, out);
    for (int y = kSmoothReach; y < height - kSmoothReach; ++y) {
      for (int x = kSmoothReach; x < width - kSmoothReach; ++x) {
        const int wx = std::max(0, 4 - std::abs(x - centre.x)), wy = std::max(0, 4 - std::abs(y - centre.y));
        const double exact = 255.0 * wx * wy / 256;
        ASSERT_GE(out.at<std::uint8_t>(y, x), std::floor(exact)) << width << " " << x << " " << y;
        ASSERT_LE(out.at<std::uint8_t>(y, x), exact + 3) << width << " " << x << " " << y;
      }
    }
  }
}

TEST(Smoother, KeepsConstantImages) {
  for (const int grey : {0, 1, 128, 255}) {
    cv::Mat image(30, 50, CV_8UC1, cv::Scalar(grey)), out(30, 50, CV_8UC1, cv::Scalar(grey));
    Smoother().smooth(image, out);
    EXPECT_EQ(cv::countNonZero(out != grey), 0) << grey;
  }
}

}  // namespace
}  // namespace semvslam
