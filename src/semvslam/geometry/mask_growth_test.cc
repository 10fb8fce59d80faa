#include "semvslam/geometry/mask_growth.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

TEST(GrowMask, ReachesAsFarAsSaidAndNotAcrossTheBorder) {
  cv::Mat mask = cv::Mat::zeros(40, 60, CV_8UC1);
  mask.at<std::uint8_t>(2, 1) = 255;
  mask.at<std::uint8_t>(20, 30) = 255;
  grow_mask(mask, 3);
  EXPECT_EQ(cv::countNonZero(mask), 7 * 7 + 6 * 5) << "7x7, and what is left of it at the corner";
  EXPECT_EQ(mask.at<std::uint8_t>(17, 27), 255);
  EXPECT_EQ(mask.at<std::uint8_t>(16, 27), 0);
  cv::Mat nothing = cv::Mat::zeros(40, 60, CV_8UC1);
  grow_mask(nothing, 3);
  EXPECT_EQ(cv::countNonZero(nothing), 0);
}

TEST(AddGrown, SetsWhatGrowingWouldSetAndKeepsTheRest) {
  cv::Mat mask = cv::Mat::zeros(20, 30, CV_8UC1), target = mask.clone();
  mask(cv::Rect(0, 5, 10, 10)).setTo(255);
  target.at<std::uint8_t>(1, 29) = 255;
  cv::Mat expected = mask.clone();
  grow_mask(expected, 3);
  expected.at<std::uint8_t>(1, 29) = 255;
  add_grown(target, mask, 3);
  EXPECT_EQ(cv::norm(target, expected, cv::NORM_INF), 0);
  add_grown(target, cv::Mat(), 3);
  EXPECT_EQ(cv::norm(target, expected, cv::NORM_INF), 0);
}

TEST(MaskWithoutRim, LosesItsRimButNotTheImagesBorder) {
  cv::Mat mask = cv::Mat::zeros(20, 30, CV_8UC1);
  mask(cv::Rect(0, 5, 10, 10)).setTo(255);
  cv::Mat expected = cv::Mat::zeros(mask.size(), CV_8UC1);
  expected(cv::Rect(0, 7, 8, 6)).setTo(255);
  cv::Mat inside(mask.size(), CV_8UC1, cv::Scalar(7));  // whatever was there
  without_rim(mask, 2, inside);
  EXPECT_EQ(cv::norm(inside, expected, cv::NORM_INF), 0);
  without_rim(mask, 0, inside);
  EXPECT_EQ(cv::norm(inside, mask, cv::NORM_INF), 0);
  without_rim(cv::Mat::zeros(mask.size(), CV_8UC1), 2, inside);
  EXPECT_EQ(cv::countNonZero(inside), 0);
}

}  // namespace
}  // namespace semvslam
