#include "semvslam/feature/fast_corners.h"

#include <gtest/gtest.h>

#include <map>
#include <opencv2/features2d.hpp>

#include "semvslam/feature/test_images.h"

namespace semvslam {
namespace {

/// Score of every pixel by OpenCV: the highest threshold at which it is a corner (0: none).
cv::Mat scores_by_opencv(const cv::Mat& image) {
  cv::Mat scores(image.size(), CV_16UC1, cv::Scalar(0));
  for (int threshold = 1; threshold < 255; ++threshold) {
    std::vector<cv::KeyPoint> corners;
    cv::FAST(image, corners, threshold, false, cv::FastFeatureDetector::TYPE_9_16);
    if (corners.empty()) break;
    for (const cv::KeyPoint& k : corners)
      scores.at<std::uint16_t>(cv::Point(k.pt)) = static_cast<std::uint16_t>(threshold);
  }
  return scores;
}

void expect_corners_of_scores(const cv::Mat& image, int border, int threshold) {
  const cv::Mat scores = scores_by_opencv(image);
  std::vector<Corner> corners;
  FastDetector().detect(image, border, threshold, corners);
  std::size_t next = 0;
  for (int y = border; y < image.rows - border; ++y) {
    for (int x = border; x < image.cols - border; ++x) {
      const int s = scores.at<std::uint16_t>(y, x);
      bool top = s >= threshold;
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const int other = scores.at<std::uint16_t>(y + j, x + i);
          const bool earlier = j < 0 || (j == 0 && i < 0);
          if (i != 0 || j != 0) top = top && (earlier ? s > other : s >= other);
        }
      }
      if (!top) continue;
      ASSERT_LT(next, corners.size()) << "missing corner at " << x << " " << y;
      ASSERT_EQ(cv::Point(corners[next].x, corners[next].y), cv::Point(x, y));
      ASSERT_EQ(corners[next].score, s);
      ++next;
    }
  }
  EXPECT_EQ(next, corners.size());
}

TEST(FastDetector, FindsTheMaximaOfTheScoreThatOpenCVDefines) {
  const cv::Mat image = with_noise(rectangles_image(203, 149), 4, 2);
  expect_corners_of_scores(image, 4, 7);
  expect_corners_of_scores(image, 18, 20);
  // Every way a row divides into blocks.
  for (const int width : {9, 40, 71, 72, 73, 74, 135, 136, 137}) {
    expect_corners_of_scores(image(cv::Rect(3, 5, width, 40)), 4, 7);
  }
}

TEST(FastDetector, SaturatedContrastHasTheHighestScore) {
  cv::Mat image(40, 40, CV_8UC1, cv::Scalar(0));
  image.at<std::uint8_t>(20, 20) = 255;
  std::vector<Corner> corners;
  FastDetector().detect(image, 4, 7, corners);
  ASSERT_EQ(corners.size(), 1u);
  EXPECT_EQ(corners[0].score, 254);
  EXPECT_EQ(cv::Point(corners[0].x, corners[0].y), cv::Point(20, 20));
}

TEST(FastDetector, FlatAndTooSmallImagesHaveNoCorners) {
  std::vector<Corner> corners{{1, 1, 1}};
  FastDetector().detect(cv::Mat(50, 50, CV_8UC1, cv::Scalar(7)), 4, 1, corners);
  EXPECT_TRUE(corners.empty());
  FastDetector().detect(rectangles_image(30, 8), 4, 1, corners);
  EXPECT_TRUE(corners.empty());
}

}  // namespace
}  // namespace semvslam
