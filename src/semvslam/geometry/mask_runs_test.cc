#include "semvslam/geometry/mask_runs.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace semvslam {
namespace {

void set_ellipse(cv::Mat& mask, const cv::Point& centre, int half_width, int half_height, int value) {
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      const double dx = double(x - centre.x) / half_width, dy = double(y - centre.y) / half_height;
      if (dx * dx + dy * dy <= 1) mask.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(value);
    }
}

TEST(MaskRuns, GivesBackTheMaskItWasMadeFrom) {
  cv::Mat mask = cv::Mat::zeros(48, 64, CV_8UC1);
  mask(cv::Rect(0, 0, 64, 1)).setTo(255);   // a full row
  mask(cv::Rect(63, 40, 1, 8)).setTo(255);  // to the right and lower border
  set_ellipse(mask, {30, 20}, 10, 10, 255);
  set_ellipse(mask, {30, 20}, 6, 6, 0);  // a ring: two runs a row
  mask(cv::Rect(5, 30, 3, 2)).setTo(1);  // any value but 0 counts
  const MaskRuns runs(mask);
  EXPECT_TRUE(runs.is_set_anywhere());
  EXPECT_EQ(runs.size(), mask.size());
  EXPECT_EQ(cv::norm(runs.mask(), mask != 0, cv::NORM_INF), 0);
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      ASSERT_EQ(runs.contains(cv::Point2f(static_cast<float>(x) + 0.4f, static_cast<float>(y) - 0.4f)),
                mask.at<std::uint8_t>(y, x) != 0)
          << x << " " << y;
}

TEST(MaskRuns, NothingIsSetOutsideOrInAnEmptyOne) {
  const MaskRuns full(cv::Mat(4, 4, CV_8UC1, cv::Scalar(255)));
  for (const cv::Point2f& p : {cv::Point2f(-1, 0), cv::Point2f(0, -1), cv::Point2f(4, 0), cv::Point2f(0, 4)})
    EXPECT_FALSE(full.contains(p));
  EXPECT_FALSE(MaskRuns().contains({0, 0}));
  EXPECT_TRUE(MaskRuns().mask().empty());
  const MaskRuns none(cv::Mat::zeros(4, 4, CV_8UC1));
  EXPECT_FALSE(none.is_set_anywhere());
  EXPECT_EQ(cv::countNonZero(none.mask()), 0);
}

TEST(MaskRuns, AMaskOfPersonsTakesFewKilobytes) {
  cv::Mat mask = cv::Mat::zeros(480, 640, CV_8UC1);
  set_ellipse(mask, {200, 300}, 60, 170, 255);
  set_ellipse(mask, {450, 320}, 50, 150, 255);
  EXPECT_LT(MaskRuns(mask).memory_bytes(), 8192U);
}

TEST(MaskRuns, IsMadeOfTheRunsOfItsRows) {
  cv::Mat mask = cv::Mat::zeros(6, 20, CV_8UC1);
  mask(cv::Rect(2, 1, 3, 4)).setTo(255);
  mask(cv::Rect(6, 2, 14, 1)).setTo(255);
  const MaskRuns runs(mask);
  std::vector<std::vector<MaskRuns::Run>> rows;
  for (int y = 0; y < mask.rows; ++y) rows.emplace_back(runs.row(y).begin(), runs.row(y).end());
  EXPECT_EQ(rows[2].size(), 2u);
  const std::optional<MaskRuns> again = MaskRuns::of_rows(mask.size(), rows);
  ASSERT_TRUE(again);
  EXPECT_EQ(cv::norm(again->mask(), mask, cv::NORM_INF), 0);
  EXPECT_TRUE(MaskRuns::of_rows({}, {}));
}

TEST(MaskRuns, RunsThatNoMaskHasAreRefused) {
  const cv::Size size(20, 1);
  const auto is_mask = [&](std::vector<MaskRuns::Run> row) { return MaskRuns::of_rows(size, {row}).has_value(); };
  EXPECT_TRUE(is_mask({{0, 4}, {5, 20}}));
  EXPECT_FALSE(is_mask({{0, 4}, {4, 6}})) << "one run, not two";
  EXPECT_FALSE(is_mask({{5, 8}, {0, 2}}));
  EXPECT_FALSE(is_mask({{5, 5}}));
  EXPECT_FALSE(is_mask({{5, 21}}));
  EXPECT_FALSE(MaskRuns::of_rows(size, {})) << "a row is missing";
  EXPECT_FALSE(MaskRuns::of_rows({70000, 1}, {{}}));
  EXPECT_FALSE(MaskRuns::of_rows({-3, 1}, {{}}));
}

TEST(MaskRuns, AnotherTypeIsAProgrammingError) {
  EXPECT_THROW(MaskRuns(cv::Mat(4, 4, CV_16UC1, cv::Scalar(1))), std::invalid_argument);
}

}  // namespace
}  // namespace semvslam
