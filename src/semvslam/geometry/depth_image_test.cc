#include "semvslam/geometry/depth_image.h"

#include <gtest/gtest.h>

#include <limits>

namespace semvslam {
namespace {

constexpr float kUnit = 0.0002f;

TEST(HalfDepth, TakesEverySecondPixelOfTheWindow) {
  cv::Mat units(5, 7, CV_16UC1);
  for (int y = 0; y < units.rows; ++y)
    for (int x = 0; x < units.cols; ++x) units.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(1000 * y + x);
  const cv::Mat all = half_depth_m(units, kUnit, {0, 0, 4, 3});
  ASSERT_EQ(all.size(), cv::Size(4, 3));
  EXPECT_FLOAT_EQ(all.at<float>(2, 3), 4006 * kUnit);
  const cv::Mat part = half_depth_m(units, kUnit, {1, 2, 2, 1});
  ASSERT_EQ(part.size(), cv::Size(2, 1));
  EXPECT_FLOAT_EQ(part.at<float>(0, 0), 4002 * kUnit);
  EXPECT_FLOAT_EQ(part.at<float>(0, 1), 4004 * kUnit);
}

TEST(HalfDepth, WhatIsNotMeasuredIsZero) {
  cv::Mat metres(2, 8, CV_32FC1, cv::Scalar(1.5));
  metres.at<float>(0, 0) = std::numeric_limits<float>::quiet_NaN();
  metres.at<float>(0, 2) = std::numeric_limits<float>::infinity();
  metres.at<float>(0, 4) = -1;
  const cv::Mat half = half_depth_m(metres, kUnit, {0, 0, 4, 1});
  EXPECT_EQ(half.at<float>(0, 0), 0);
  EXPECT_EQ(half.at<float>(0, 1), 0);
  EXPECT_EQ(half.at<float>(0, 2), 0);
  EXPECT_EQ(half.at<float>(0, 3), 1.5f);
}

}  // namespace
}  // namespace semvslam
