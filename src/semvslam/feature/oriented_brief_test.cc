#include "semvslam/feature/oriented_brief.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "semvslam/feature/brief_pattern.h"
#include "semvslam/feature/test_images.h"

namespace semvslam {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

float angle_at(const cv::Mat& image, int x, int y) {
  return patch_angle_rad(image.ptr<std::uint8_t>(y) + x, static_cast<std::ptrdiff_t>(image.step[0]));
}

TEST(BriefPattern, TestsAreDistinctAndStayInTheDisc) {
  std::set<std::array<int, 4>> seen;
  int reach = 0;
  for (const BriefTest& t : brief_pattern()) {
    EXPECT_LE(t.ax * t.ax + t.ay * t.ay, kBriefRadius * kBriefRadius);
    EXPECT_LE(t.bx * t.bx + t.by * t.by, kBriefRadius * kBriefRadius);
    EXPECT_TRUE(seen.insert({t.ax, t.ay, t.bx, t.by}).second);
    EXPECT_FALSE(seen.contains({t.bx, t.by, t.ax, t.ay}));  // the same question asked backwards
    reach = std::max({reach, std::abs(t.ax), std::abs(t.by)});
  }
  EXPECT_GE(reach, 10);
}

TEST(PatchAngle, PointsToTheBrightSideWhereverThatIs) {
  for (int i = 0; i < 48; ++i) {
    const double angle = i * kTurn / 48;
    cv::Mat image(64, 64, CV_8UC1);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double along = (x - 30) * std::cos(angle) + (y - 33) * std::sin(angle);
        image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(128 + 4 * along);
      }
    }
    EXPECT_NEAR(std::remainder(angle_at(image, 30, 33) - angle, kTurn), 0, 0.005) << i;
  }
}

TEST(PatchAngle, SeesTheDiscOnly) {
  cv::Mat image = rectangles_image(64, 64, 3);
  const float before = angle_at(image, 32, 32);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      if (std::hypot(x - 32, y - 32) > kPatchRadius + 0.5) image.at<std::uint8_t>(y, x) = 255;
    }
  }
  EXPECT_EQ(angle_at(image, 32, 32), before);
}

TEST(PatchAngle, IsInRangeForFlatAndExtremePatches) {
  cv::Mat image(64, 64, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(angle_at(image, 32, 32), 0.f);
  image.rowRange(0, 32).setTo(0);  // the largest moment there is, along +y
  EXPECT_NEAR(angle_at(image, 32, 32), kTurn / 4, 1e-6);
  image.setTo(255);
  image.rowRange(33, 64).setTo(0);
  EXPECT_NEAR(angle_at(image, 32, 32), 3 * kTurn / 4, 1e-6);
}

TEST(OrientedBrief, BitsAreTheTestsOfThePattern) {
  const cv::Mat image = rectangles_image(64, 64, 9, 12);
  OrientedBrief brief;
  brief.set_stride(static_cast<std::ptrdiff_t>(image.step[0]));
  const Descriptor d = brief.describe(image.ptr<std::uint8_t>(31) + 30, 0.f);
  for (std::size_t i = 0; i < 256; ++i) {
    const BriefTest& t = brief_pattern()[i];
    const bool darker = image.at<std::uint8_t>(31 + t.ay, 30 + t.ax) < image.at<std::uint8_t>(31 + t.by, 30 + t.bx);
    ASSERT_EQ((d[i / 64] >> (i % 64)) & 1, darker ? 1u : 0u) << i;
  }
}

TEST(OrientedBrief, TurnsWithTheImage) {
  const cv::Mat image = rectangles_image(65, 65, 9, 12);
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);  // y down: clockwise is the positive direction
  OrientedBrief brief;
  brief.set_stride(static_cast<std::ptrdiff_t>(image.step[0]));
  const Descriptor a = brief.describe(image.ptr<std::uint8_t>(32) + 32, 0.f);
  const Descriptor b = brief.describe(turned.ptr<std::uint8_t>(32) + 32, static_cast<float>(kTurn / 4));
  EXPECT_EQ(a, b);
  // Just below a full turn is the same as zero.
  EXPECT_EQ(brief.describe(image.ptr<std::uint8_t>(32) + 32, static_cast<float>(kTurn - 1e-4)), a);
}

}  // namespace
}  // namespace semvslam
