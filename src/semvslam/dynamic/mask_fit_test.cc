#include "semvslam/dynamic/mask_fit.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

/// A thing 1.5 m away before a wall at 3 m.
class MaskFitTest : public ::testing::Test {
 protected:
  MaskFitTest() : depth(120, 160, CV_32FC1, cv::Scalar(3.0)), truth(120, 160, CV_8UC1, cv::Scalar(0)) {
    depth(thing).setTo(1.5);
    truth(thing).setTo(255);
  }
  cv::Mat shifted(int dx, int dy) const {
    cv::Mat mask = cv::Mat::zeros(120, 160, CV_8UC1);
    mask(thing + cv::Point(dx, dy)).setTo(255);
    return mask;
  }
  static int difference(const cv::Mat& a, const cv::Mat& b) { return cv::countNonZero(a != b); }

  const cv::Rect thing{50, 40, 60, 60};
  cv::Mat depth, truth;
};

TEST_F(MaskFitTest, AnOutlineThatIsOffMovesToTheEdgeOfDepth) {
  cv::Mat mask = shifted(6, -4);
  const int before = difference(mask, truth);
  fit_to_depth(mask, depth, 1.f, {});
  EXPECT_LT(difference(mask, truth), before / 10);
}

TEST_F(MaskFitTest, ARightMaskAndOneFarFromAnyEdgeStay) {
  cv::Mat mask = truth.clone();
  fit_to_depth(mask, depth, 1.f, {});
  EXPECT_EQ(difference(mask, truth), 0);
  cv::Mat untouched = shifted(6, -4);
  fit_to_depth(untouched, depth, 1.f, {.band_px = 0});
  EXPECT_EQ(difference(untouched, shifted(6, -4)), 0);
}

TEST_F(MaskFitTest, WithoutDepthNothingChanges) {
  cv::Mat mask = shifted(6, -4);
  fit_to_depth(mask, cv::Mat(), 1.f, {});
  fit_to_depth(mask, cv::Mat(120, 160, CV_32FC1, cv::Scalar(0)), 1.f, {});
  fit_to_depth(mask, cv::Mat(60, 80, CV_32FC1, cv::Scalar(1)), 1.f, {});
  EXPECT_EQ(difference(mask, shifted(6, -4)), 0);
}

TEST_F(MaskFitTest, ReadsSixteenBitDepthInItsUnits) {
  cv::Mat units;
  depth.convertTo(units, CV_16UC1, 5000);
  cv::Mat by_units = shifted(4, 4), by_metres = shifted(4, 4);
  fit_to_depth(by_units, units, 1.f / 5000, {});
  fit_to_depth(by_metres, depth, 1.f, {});
  EXPECT_EQ(difference(by_units, by_metres), 0);
}

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
