#include "semvslam/geometry/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace semvslam {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Camera pinhole() {
  Camera c;
  c.width_px = 640;
  c.height_px = 480;
  c.fx_px = 517.3;
  c.fy_px = 516.5;
  c.cx_px = 318.6;
  c.cy_px = 255.3;
  return c;
}

TEST(Camera, BackProjectionUndoesProjection) {
  const Camera c = pinhole();
  const Eigen::Vector3d p(0.4, -0.3, 2.5);
  EXPECT_LT((c.back_project(c.project(p), 2.5) - p).norm(), 1e-14);
  EXPECT_EQ(c.project({0, 0, 1}), Eigen::Vector2d(318.6, 255.3));
}

TEST(Camera, WithoutDistortionPixelsStay) {
  const Eigen::Vector2d p(12.5, 400);
  EXPECT_EQ(pinhole().distort(p), p);
  EXPECT_EQ(pinhole().undistort(p), p);
}

// The lenses of the TUM recordings freiburg1 and freiburg2, the strongest in use here.
class CameraLens : public testing::TestWithParam<BrownDistortion> {};

TEST_P(CameraLens, UndistortUndoesDistortInTheWholeImage) {
  Camera c = pinhole();
  c.distortion = GetParam();
  for (double y = 0; y <= 479; y += 47.9) {
    for (double x = 0; x <= 639; x += 63.9) {
      const Eigen::Vector2d recorded(x, y);
      const Eigen::Vector2d ideal = c.undistort(recorded);
      EXPECT_LT((c.distort(ideal) - recorded).norm(), 1e-6) << x << " " << y;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Lenses, CameraLens,
                         testing::Values(BrownDistortion{0.2624, -0.9531, -0.0054, 0.0026, 1.1633},
                                         BrownDistortion{0.2312, -0.7849, -0.0033, -0.0001, 0.9172},
                                         BrownDistortion{-0.3, 0.1, 0.001, -0.002, 0}));

TEST(Camera, UndistortStaysFiniteWhereTheLensHasNoInverse) {
  Camera c = pinhole();
  c.distortion = {-2, 0, 0, 0, 0};  // folds over at a radius of 0.41
  EXPECT_TRUE(c.undistort({639, 479}).allFinite());
  EXPECT_TRUE(c.undistort({0, 0}).allFinite());
}

TEST(Camera, DistortFollowsTheFormula) {
  Camera c = pinhole();
  c.distortion = {0.1, -0.02, 0.003, -0.004, 0.005};
  const double x = 0.3, y = -0.2, r2 = x * x + y * y;
  const double radial = 1 + 0.1 * r2 - 0.02 * r2 * r2 + 0.005 * r2 * r2 * r2;
  const double xd = x * radial + 2 * 0.003 * x * y - 0.004 * (r2 + 2 * x * x);
  const double yd = y * radial + 0.003 * (r2 + 2 * y * y) - 2 * 0.004 * x * y;
  const Eigen::Vector2d got = c.distort({c.fx_px * x + c.cx_px, c.fy_px * y + c.cy_px});
  EXPECT_NEAR(got.x(), c.fx_px * xd + c.cx_px, 1e-10);
  EXPECT_NEAR(got.y(), c.fy_px * yd + c.cy_px, 1e-10);
}

TEST(Camera, HowFarApartTwoCamerasSeeTheSame) {
  Camera lens = pinhole();
  lens.distortion = {0.2624, -0.9531, -0.0054, 0.0026, 1.1633};
  EXPECT_LT(lens.largest_shift_px(lens), 1e-6);
  Camera moved = lens;
  moved.cy_px += 3;
  EXPECT_NEAR(lens.largest_shift_px(moved), 3, 1e-6);
  EXPECT_NEAR(moved.largest_shift_px(lens), 3, 1e-6);
  Camera longer = pinhole();
  longer.fx_px *= 1.01;  // at the border that is farther from the centre, 320.4 px
  EXPECT_NEAR(pinhole().largest_shift_px(longer), 3.204, 1e-3);
  EXPECT_GT(pinhole().largest_shift_px(lens), 5) << "the lens alone";
}

TEST(Camera, CheckNamesWhatIsWrong) {
  EXPECT_TRUE(pinhole().check().ok());
  const auto complains = [](auto change, const char* word) {
    Camera c = pinhole();
    change(c);
    const Status s = c.check();
    return !s.ok() && s.error().code == ErrorCode::kInvalidInput && s.error().message.find(word) != std::string::npos;
  };
  EXPECT_TRUE(complains([](Camera& c) { c.width_px = 1; }, "size"));
  EXPECT_TRUE(complains([](Camera& c) { c.height_px = 20000; }, "size"));
  EXPECT_TRUE(complains([](Camera& c) { c.fx_px = 0; }, "fx"));
  EXPECT_TRUE(complains([](Camera& c) { c.fy_px = -500; }, "fy"));
  EXPECT_TRUE(complains([](Camera& c) { c.fx_px = kNan; }, "focal"));
  EXPECT_TRUE(complains([](Camera& c) { c.cx_px = 640; }, "principal"));
  EXPECT_TRUE(complains([](Camera& c) { c.cy_px = kNan; }, "principal"));
  EXPECT_TRUE(complains([](Camera& c) { c.depth_units_per_m = 0; }, "depth_units_per_m"));
  EXPECT_TRUE(complains([](Camera& c) { c.baseline_m = -1; }, "baseline_m"));
  EXPECT_TRUE(complains([](Camera& c) { c.frame_rate_hz = kNan; }, "frame_rate_hz"));
  EXPECT_TRUE(complains([](Camera& c) { c.distortion.k3 = kNan; }, "distortion"));
}

}  // namespace
}  // namespace semvslam
