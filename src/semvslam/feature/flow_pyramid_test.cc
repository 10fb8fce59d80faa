#include "semvslam/feature/flow_pyramid.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

cv::Mat noise(int width, int height) {
  Random random(5, "pyramid.test");
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.index(256));
  return image;
}

TEST(FlowPyramid, LevelsAreThoseOfTheBinomialFilter) {
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(321, 243), cv::Size(77, 200)}) {
    FlowPyramid pyramid;
    cv::Mat expected = noise(size.width, size.height);
    pyramid.build(expected, 3, 15);
    ASSERT_GE(pyramid.top(), 2);
    for (int level = 0; level <= pyramid.top(); ++level) {
      if (level > 0) cv::pyrDown(expected.clone(), expected);
      ASSERT_EQ(pyramid.level(level).size(), expected.size());
      EXPECT_EQ(cv::norm(pyramid.level(level), expected, cv::NORM_INF), 0) << size << " level " << level;
    }
  }
}

TEST(FlowPyramid, TheMarginIsMirrored) {
  FlowPyramid pyramid;
  const cv::Mat image = noise(90, 70);
  pyramid.build(image, 1, 15);
  const int margin = pyramid.margin_px();
  ASSERT_GE(margin, 16);
  for (int level = 0; level <= 1; ++level) {
    const cv::Mat& inner = pyramid.level(level);
    cv::Mat expected, padded = inner;
    cv::copyMakeBorder(inner.clone(), expected, margin, margin, margin, margin, cv::BORDER_REFLECT_101);
    padded.adjustROI(margin, margin, margin, margin);
    ASSERT_EQ(padded.size(), expected.size());
    EXPECT_EQ(cv::norm(padded, expected, cv::NORM_INF), 0);
  }
}

TEST(FlowPyramid, NoLevelIsAsSmallAsThePatch) {
  FlowPyramid pyramid;
  pyramid.build(noise(100, 50), 6, 15);
  EXPECT_EQ(pyramid.top(), 1);  // 25 rows; 13 would be fewer than 15
  pyramid.build(noise(8, 8), 6, 15);
  EXPECT_EQ(pyramid.top(), 0);
}

TEST(FlowPyramid, KeepsNoneOfTheImageBefore) {
  FlowPyramid again, fresh;
  again.build(noise(200, 120), 3, 15);
  cv::Mat other = noise(200, 120), turned;
  cv::flip(other, turned, 1);
  again.build(turned, 3, 15);
  fresh.build(turned, 3, 15);
  turned.setTo(0);  // it was copied
  for (int level = 0; level <= fresh.top(); ++level)
    EXPECT_EQ(cv::norm(again.level(level), fresh.level(level), cv::NORM_INF), 0);
}

TEST(FlowPyramid, OtherImagesAreRefused) {
  FlowPyramid pyramid;
  EXPECT_TRUE(pyramid.empty());
  EXPECT_THROW(pyramid.build(cv::Mat(), 3, 15), std::invalid_argument);
  EXPECT_THROW(pyramid.build(cv::Mat(50, 50, CV_8UC3), 3, 15), std::invalid_argument);
}

}  // namespace
}  // namespace semvslam
