#include "semvslam/feature/lucas_kanade.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

constexpr int kWidth = 640, kHeight = 480, kMarginPx = 130;

// Smooth random grey values with detail at several scales, larger than the image so that it can be moved.
const cv::Mat& texture() {
  static const cv::Mat instance = [] {
    Random random(3, "lucas_kanade.test");
    cv::Mat sum = cv::Mat::zeros(kHeight + 2 * kMarginPx, kWidth + 2 * kMarginPx, CV_32FC1);
    for (const int period_px : {5, 17, 60}) {
      cv::Mat noise(sum.rows / period_px + 2, sum.cols / period_px + 2, CV_32FC1), large;
      for (int y = 0; y < noise.rows; ++y)
        for (int x = 0; x < noise.cols; ++x) noise.at<float>(y, x) = static_cast<float>(random.uniform(0, 85));
      cv::resize(noise, large, noise.size() * period_px, 0, 0, cv::INTER_CUBIC);
      sum += large(cv::Rect({0, 0}, sum.size()));
    }
    return sum;
  }();
  return instance;
}

// The texture where image point p shows texture point matrix * p (+ margin), rounded to 8 bits once.
cv::Mat view(const cv::Matx23d& matrix) {
  cv::Matx23d shifted = matrix;
  shifted(0, 2) += kMarginPx;
  shifted(1, 2) += kMarginPx;
  cv::Mat out(kHeight, kWidth, CV_32FC1), grey;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      // Bicubic and not through cv::remap, whose fractions have 5 bits.
      const double u = shifted(0, 0) * x + shifted(0, 1) * y + shifted(0, 2);
      const double v = shifted(1, 0) * x + shifted(1, 1) * y + shifted(1, 2);
      const int iu = static_cast<int>(std::floor(u)), iv = static_cast<int>(std::floor(v));
      const auto weights = [](double t) {
        const double a = -0.5;
        return std::array<double, 4>{a * (t * t * t - 2 * t * t + t), (a + 2) * t * t * t - (a + 3) * t * t + 1,
                                     -(a + 2) * t * t * t + (2 * a + 3) * t * t - a * t, a * (t * t - t * t * t)};
      };
      const auto wu = weights(u - iu), wv = weights(v - iv);
      double sum = 0;
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
          sum += wu[static_cast<std::size_t>(i)] * wv[static_cast<std::size_t>(j)] *
                 static_cast<double>(texture().at<float>(iv - 1 + j, iu - 1 + i));
      out.at<float>(y, x) = static_cast<float>(sum);
    }
  out.convertTo(grey, CV_8UC1);
  return grey;
}

cv::Mat shifted_view(double x, double y) { return view({1, 0, -x, 0, 1, -y}); }

FlowPyramid pyramid_of(const cv::Mat& gray, int levels = 3, int window_px = 15) {
  FlowPyramid pyramid;
  pyramid.build(gray, levels, window_px);
  return pyramid;
}

std::vector<cv::Point2f> raster(float from_border_px) {
  std::vector<cv::Point2f> points;
  for (float y = from_border_px; y < kHeight - from_border_px; y += 29.37f)
    for (float x = from_border_px; x < kWidth - from_border_px; x += 31.13f) points.emplace_back(x, y);
  return points;
}

struct Errors {
  double mean_px = 0, largest_px = 0, found_share = 0;
};

template <typename Truth>
Errors errors_of(const cv::Mat& a, const cv::Mat& b, const std::vector<cv::Point2f>& points, const Truth& truth,
                 const LucasKanadeOptions& options = {}) {
  const FlowPyramid from = pyramid_of(a, options.levels, options.window_px),
                    to = pyramid_of(b, options.levels, options.window_px);
  Errors errors;
  int found = 0;
  for (const cv::Point2f& p : points) {
    cv::Point2f q = p;
    if (!follow_point(from, to, p, options, q)) continue;
    ++found;
    const double error = cv::norm(q - truth(p));
    errors.mean_px += error;
    errors.largest_px = std::max(errors.largest_px, error);
  }
  errors.mean_px /= found;
  errors.found_share = static_cast<double>(found) / static_cast<double>(points.size());
  return errors;
}

TEST(LucasKanade, FollowsShiftsToHundredthsOfAPixel) {
  const cv::Mat first = shifted_view(0, 0);
  for (const cv::Point2f shift : {cv::Point2f(0.3f, -0.7f), cv::Point2f(2.45f, 1.15f), cv::Point2f(-7.3f, 4.6f)}) {
    const Errors e = errors_of(first, shifted_view(shift.x, shift.y), raster(30), [&](auto p) { return p + shift; });
    EXPECT_EQ(e.found_share, 1) << shift;
    EXPECT_LT(e.mean_px, 0.02) << shift;
    EXPECT_LT(e.largest_px, 0.1) << shift;
  }
}

TEST(LucasKanade, EveryWindowFollows) {
  const cv::Mat first = shifted_view(0, 0), second = shifted_view(3.4, -2.2);
  for (const int window : {7, 15, 17, 31, 33, 41}) {
    LucasKanadeOptions options;
    options.window_px = window;
    const Errors e = errors_of(
        first, second, raster(30), [](auto p) { return p + cv::Point2f(3.4f, -2.2f); }, options);
    EXPECT_GT(e.found_share, 0.99) << window;
    EXPECT_LT(e.mean_px, window < 15 ? 0.1 : 0.02) << window;
  }
}

TEST(LucasKanade, FollowsATurnAndAZoom) {
  // Image point p shows texture point centre + m (p - centre): it comes from there in the first image. A mere shift of
  // a patch is not quite that: the bound is what remains.
  const double angle = 0.03, zoom = 1.02;
  const cv::Matx22d m(zoom * std::cos(angle), -zoom * std::sin(angle), zoom * std::sin(angle), zoom * std::cos(angle));
  const cv::Vec2d centre(320, 240), rest = centre - m * centre;
  const cv::Matx22d back = m.inv();
  const Errors e = errors_of(shifted_view(0, 0), view({m(0, 0), m(0, 1), rest[0], m(1, 0), m(1, 1), rest[1]}),
                             raster(40), [&](cv::Point2f p) {
                               const cv::Vec2d q = centre + back * (cv::Vec2d(p.x, p.y) - centre);
                               return cv::Point2f(static_cast<float>(q[0]), static_cast<float>(q[1]));
                             });
  EXPECT_GT(e.found_share, 0.99);
  EXPECT_LT(e.mean_px, 0.12);
}

TEST(LucasKanade, LargeMotionNeedsThePyramid) {
  const cv::Point2f shift(31.6f, -12.4f);
  const cv::Mat first = shifted_view(0, 0), second = shifted_view(shift.x, shift.y);
  const auto right_share = [&](int levels) {
    LucasKanadeOptions options;
    options.levels = levels;
    const FlowPyramid from = pyramid_of(first), to = pyramid_of(second);
    int right = 0;
    const std::vector<cv::Point2f> points = raster(60);
    for (const cv::Point2f& p : points) {
      cv::Point2f q = p;
      right += follow_point(from, to, p, options, q) && cv::norm(q - p - shift) < 0.2;
    }
    return static_cast<double>(right) / static_cast<double>(points.size());
  };
  EXPECT_GT(right_share(3), 0.9);
  EXPECT_LT(right_share(0), 0.1);
}

TEST(LucasKanade, AgreesWithOpenCv) {
  const cv::Mat first = shifted_view(0, 0), second = view({1.01, 0.012, -6.2, -0.012, 1.01, 2.9});
  const FlowPyramid from = pyramid_of(first), to = pyramid_of(second);
  const std::vector<cv::Point2f> points = raster(20);
  std::vector<cv::Point2f> reference;
  std::vector<std::uint8_t> status;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(first, second, points, reference, status, error, cv::Size(15, 15), 3,
                           cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 12, 0.03));
  double sum_px = 0;
  int both = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    cv::Point2f q = points[i];
    EXPECT_EQ(follow_point(from, to, points[i], {}, q), status[i] != 0) << i;
    if (!status[i]) continue;
    ++both;
    sum_px += cv::norm(q - reference[i]);
  }
  EXPECT_GT(both, 250);
  EXPECT_LT(sum_px / both, 0.01);
}

TEST(LucasKanade, TheSameImageIsNoMotionAtAll) {
  const FlowPyramid pyramid = pyramid_of(shifted_view(0, 0));
  for (const cv::Point2f& p : raster(0.4f)) {
    cv::Point2f q = p;
    EXPECT_TRUE(follow_point(pyramid, pyramid, p, {}, q));
    EXPECT_NEAR(q.x, p.x, 1e-5);
    EXPECT_NEAR(q.y, p.y, 1e-5);
  }
}

TEST(LucasKanade, TheSameCallGivesTheSameBits) {
  const cv::Mat first = shifted_view(0, 0), second = shifted_view(4.3, 2.1);
  const FlowPyramid from = pyramid_of(first), to = pyramid_of(second);
  FlowPyramid again;
  again.build(shifted_view(9, 9), 3, 15);
  again.build(second, 3, 15);
  for (const cv::Point2f& p : raster(12)) {
    cv::Point2f q = p, r = p;
    follow_point(from, to, p, {}, q);
    follow_point(from, again, p, {}, r);
    EXPECT_EQ(q, r);
  }
}

TEST(LucasKanade, PointsAtTheBorder) {
  const cv::Point2f shift(0.8f, 0.6f);
  const FlowPyramid from = pyramid_of(shifted_view(0, 0)), to = pyramid_of(shifted_view(shift.x, shift.y));
  // On and outside all borders and far away; a third of a pixel from it the patch is half mirror.
  for (float y = -40; y < kHeight + 40; y += 6.7f)
    for (const float x : {-1e9f, -30.f, -9.f, -8.f, -3.f, 0.f, 639.f, 639.9f, 646.f, 647.5f, 660.f, 3e9f}) {
      cv::Point2f q(x, y);
      follow_point(from, to, {x, y}, {}, q);
      cv::Point2f r(y, x);
      follow_point(from, to, {y, x}, {}, r);
    }
  cv::Point2f outside(-9, 100), nowhere(std::numeric_limits<float>::quiet_NaN(), 100);
  EXPECT_FALSE(follow_point(from, to, outside, {}, outside));
  EXPECT_FALSE(follow_point(from, to, nowhere, {}, nowhere));
  for (const cv::Point2f& p : {cv::Point2f(9, 200), cv::Point2f(630, 300), cv::Point2f(300, 9), cv::Point2f(9, 470)}) {
    cv::Point2f q = p;
    EXPECT_TRUE(follow_point(from, to, p, {}, q));
    EXPECT_NEAR(q.x - p.x, shift.x, 0.1);
    EXPECT_NEAR(q.y - p.y, shift.y, 0.1);
  }
}

TEST(LucasKanade, FlatPatchesAndEdgesAreRefused) {
  const auto found = [](const cv::Mat& image) {
    const FlowPyramid pyramid = pyramid_of(image);
    cv::Point2f p(320, 240);
    return follow_point(pyramid, pyramid, p, {}, p);
  };
  EXPECT_FALSE(found(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(128))));
  cv::Mat edge(kHeight, kWidth, CV_8UC1, cv::Scalar(20));
  edge.colRange(320, kWidth).setTo(220);
  EXPECT_FALSE(found(edge));
  edge.rowRange(240, kHeight).setTo(120);
  EXPECT_TRUE(found(edge));
}

TEST(LucasKanade, FullContrastDoesNotOverflow) {
  // Stripes and squares of black and white have the largest sums there are.
  for (const int window : {15, 41})
    for (const int period : {2, 4, 9, 64}) {
      cv::Mat image(kHeight, kWidth, CV_8UC1);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) image.at<std::uint8_t>(y, x) = (x / period + y / (3 * period)) % 2 ? 255 : 0;
      LucasKanadeOptions options;
      options.window_px = window;
      const FlowPyramid pyramid = pyramid_of(image, 3, window);
      for (float x = 300; x < 320; x += 1.3f) {
        cv::Point2f q(x, 240);
        if (!follow_point(pyramid, pyramid, {x, 240}, options, q)) continue;
        EXPECT_NEAR(q.x, x, 1e-4);
      }
    }
}

TEST(LucasKanade, PyramidsOfAnotherWindowAreRefused) {
  const FlowPyramid pyramid = pyramid_of(shifted_view(0, 0), 1, 15);
  LucasKanadeOptions options;
  options.window_px = 31;
  cv::Point2f p(100, 100);
  EXPECT_THROW(follow_point(pyramid, pyramid, p, options, p), std::invalid_argument);
  EXPECT_THROW(follow_point(pyramid, FlowPyramid(), p, {}, p), std::invalid_argument);
}

TEST(MeanTexture, IsTheMeanOfTheSquaredGradient) {
  const cv::Mat image = shifted_view(0, 0);
  const FlowPyramid pyramid = pyramid_of(image);
  cv::Mat gx, gy;
  cv::Scharr(image, gx, CV_32F, 1, 0, 1.0 / 32);
  cv::Scharr(image, gy, CV_32F, 0, 1, 1.0 / 32);
  for (const cv::Point p : {cv::Point(10, 10), cv::Point(321, 77), cv::Point(629, 469)})
    for (const int radius : {1, 5, 7}) {
      const cv::Rect patch(p.x - radius, p.y - radius, 2 * radius + 1, 2 * radius + 1);
      const cv::Mat x = gx(patch), y = gy(patch);
      const cv::Vec3f texture = mean_texture(pyramid, p, radius);
      EXPECT_NEAR(texture[0], x.dot(x) / patch.area(), 1e-3);
      EXPECT_NEAR(texture[1], x.dot(y) / patch.area(), 1e-3);
      EXPECT_NEAR(texture[2], y.dot(y) / patch.area(), 1e-3);
    }
}

TEST(PatchDifference, IsTheMeanAbsoluteDifference) {
  const cv::Mat a = shifted_view(0, 0), b = shifted_view(1.5, 0.25);
  cv::Mat brighter;
  a.convertTo(brighter, -1, 0.5, 60);
  cv::Mat half_grey;
  a.convertTo(half_grey, -1, 0.5, 0);
  const FlowPyramid pa = pyramid_of(a), pb = pyramid_of(b), bright = pyramid_of(brighter), half = pyramid_of(half_grey);
  for (const cv::Point2f& p : raster(14)) {
    EXPECT_EQ(patch_difference(pa, p, pa, p, 9, true), 0);
    EXPECT_LT(patch_difference(pa, p, pb, p + cv::Point2f(1.5f, 0.25f), 9, false), 4);
    EXPECT_NEAR(patch_difference(half, p, bright, p, 9, false), 60, 0.1);
    EXPECT_LT(patch_difference(half, p, bright, p, 9, true), 0.1);
  }
  // Whole pixels against the definition.
  for (const int window : {9, 15}) {
    const cv::Rect ra(100 - window / 2, 90 - window / 2, window, window), rb = ra + cv::Point(40, 30);
    cv::Mat fa, fb;
    a(ra).convertTo(fa, CV_32F);
    b(rb).convertTo(fb, CV_32F);
    cv::Mat d = fa - fb;
    const auto mean_of = [&] { return cv::norm(d, cv::NORM_L1) / static_cast<double>(d.total()); };
    EXPECT_NEAR(patch_difference(pa, {100, 90}, pb, {140, 120}, window, false), mean_of(), 0.02);
    d -= cv::mean(d);
    EXPECT_NEAR(patch_difference(pa, {100, 90}, pb, {140, 120}, window, true), mean_of(), 0.02);
  }
}

}  // namespace
}  // namespace semvslam
