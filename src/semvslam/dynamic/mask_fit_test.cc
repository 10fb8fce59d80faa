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

}  // namespace
}  // namespace semvslam
