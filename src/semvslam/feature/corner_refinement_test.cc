#include "semvslam/feature/corner_refinement.h"

#include <gtest/gtest.h>

#include <cmath>

#include "semvslam/feature/test_images.h"

namespace semvslam {
namespace {

/// A bright quadrant whose corner is at (x, y), its edges smoothed as a lens does (Gaussian of 1 px).
cv::Mat quadrant(double x, double y) {
  cv::Mat image(48, 48, CV_8UC1);
  const auto step = [](double d) { return 0.5 * (1 + std::erf(d / std::sqrt(2.0))); };
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 48; ++u) {
      image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(40 + 160 * step(u - x) * step(v - y));
    }
  }
  return image;
}

cv::Point2d refined(const cv::Mat& image, int x, int y) {
  const RefinedCorner r = refine_corner(image, x, y, cv::Rect(10, 10, image.cols - 20, image.rows - 20));
  return {r.x + static_cast<double>(r.dx_px), r.y + static_cast<double>(r.dy_px)};
}

TEST(RefineCorner, FollowsACornerThatMovesByPartsOfAPixel) {
  // Where a score peaks at a corner is a convention; that it moves with the corner is what counts.
  const cv::Point2d origin = refined(quadrant(24, 24), 24, 24) - cv::Point2d(24, 24);
  EXPECT_LT(std::hypot(origin.x, origin.y), 2.0);  // Harris peaks inside of a smoothed corner
  for (int i = 0; i <= 8; ++i) {
    for (int j = 0; j <= 8; ++j) {
      const cv::Point2d at(24 + i / 8.0, 24 + j / 8.0);
      for (const cv::Point start :
           {cv::Point(24, 24), cv::Point(25, 25), cv::Point(26, 24)}) {  // FAST answers around it
        const cv::Point2d error = refined(quadrant(at.x, at.y), start.x, start.y) - at - origin;
        EXPECT_LT(std::hypot(error.x, error.y), 0.08) << at << start;
      }
    }
  }
}

TEST(RefineCorner, FindsTheCentreOfADot) {
  for (const cv::Point2d at : {cv::Point2d(24, 24), cv::Point2d(24.3, 23.8), cv::Point2d(24.49, 24.49)}) {
    const cv::Point2d error = refined(dots_image(48, 48, {at}, 1.5), 25, 23) - at;
    EXPECT_LT(std::hypot(error.x, error.y), 0.05) << at;
  }
}

TEST(RefineCorner, StaysInside) {
  const cv::Mat image = quadrant(20, 20);
  const RefinedCorner r = refine_corner(image, 23, 23, cv::Rect(23, 22, 10, 10));
  EXPECT_EQ(r.x, 23);
  EXPECT_EQ(r.y, 22);
}

TEST(RefineCorner, AFlatImageMovesNothing) {
  const RefinedCorner r = refine_corner(cv::Mat(48, 48, CV_8UC1, cv::Scalar(99)), 24, 25, cv::Rect(0, 0, 48, 48));
  EXPECT_EQ(cv::Point(r.x, r.y), cv::Point(24, 25));
  EXPECT_EQ(r.dx_px, 0);
  EXPECT_EQ(r.dy_px, 0);
}

TEST(RefineCorner, FullContrastDoesNotOverflow) {
  cv::Mat image(48, 48, CV_8UC1, cv::Scalar(0));  // a fine chequerboard: the largest gradients 8 bits can have
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 48; ++x) {
      if ((x / 2 + y / 2) % 2) image.at<std::uint8_t>(y, x) = 255;
    }
  }
  const cv::Point2d p = refined(image, 24, 24);
  EXPECT_LE(std::abs(p.x - 24), kRefineReach + 1);
  EXPECT_LE(std::abs(p.y - 24), kRefineReach + 1);
}

}  // namespace
}  // namespace semvslam
