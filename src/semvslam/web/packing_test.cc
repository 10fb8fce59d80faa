#include "semvslam/web/packing.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string_view>

namespace semvslam {
namespace {

std::string base64_of(std::string_view text) {
  return base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(Base64, IsThatOfTheStandard) {
  // RFC 4648, section 10
  EXPECT_EQ(base64_of(""), "");
  EXPECT_EQ(base64_of("f"), "Zg==");
  EXPECT_EQ(base64_of("fo"), "Zm8=");
  EXPECT_EQ(base64_of("foo"), "Zm9v");
  EXPECT_EQ(base64_of("foob"), "Zm9vYg==");
  EXPECT_EQ(base64_of("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64_of("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64_of("\xff\xef\xbe"), "/+++");
}

TEST(Packed, HoldsTheBytesOfTheNumbers) {
  EXPECT_EQ(packed(std::vector<float>{1.0f}), "AACAPw==");
  EXPECT_EQ(packed(std::vector<std::uint16_t>{0x0102, 0xffff}), "AgH//w==");
}

TEST(Quantised, ComesBackWithinHalfAStep) {
  std::vector<Eigen::Vector3f> points{{-3, 0, 2}, {7, 0, 2.5f}};
  for (int i = 0; i < 1000; ++i)
    points.emplace_back(-3 + 0.01f * static_cast<float>(i), 0, 2 + 0.0005f * static_cast<float>(i));
  const QuantisedPoints q = quantised(points);
  ASSERT_EQ(q.grid.size(), 3 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double back = q.origin_m[axis] + q.step_m[axis] * q.grid[3 * i + static_cast<std::size_t>(axis)];
      EXPECT_NEAR(back, points[i][axis], 0.5 * q.step_m[axis] + 1e-6) << i;
    }
  EXPECT_NEAR(q.step_m.x(), 10.0 / 65535, 1e-12);
}

TEST(Quantised, OnePointAndNoneArePointsToo) {
  EXPECT_TRUE(quantised({}).grid.empty());
  const QuantisedPoints q = quantised(std::vector<Eigen::Vector3f>{{1, 2, 3}});
  EXPECT_EQ(q.origin_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(q.grid, (std::vector<std::uint16_t>{0, 0, 0}));
}

}  // namespace
}  // namespace semvslam
