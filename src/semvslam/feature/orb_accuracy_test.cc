// How well features are placed and found again, on images whose geometry is known exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "semvslam/feature/matching.h"
#include "semvslam/feature/orb_extractor.h"
#include "semvslam/feature/test_images.h"

namespace semvslam {
namespace {

OrbFeatures extract(const cv::Mat& image, const OrbOptions& options) {
  OrbExtractor extractor(options);
  OrbFeatures features;
  extractor.extract(image, {}, features);
  return features;
}

double median(std::vector<double> values) {
  if (values.empty()) return NAN;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Dots with known centres, as large as the level likes them: found on it, without bias, in an image whose sizes no
/// level divides evenly.
TEST(OrbAccuracy, PositionsHaveNoBiasOnAnyLevel) {
  OrbOptions options;
  options.features = 20000;
  const std::vector<float> scales = level_scales(options);
  for (int level = 0; level < options.levels; ++level) {
    const double scale = scales[static_cast<std::size_t>(level)], spacing = 36 * scale;
    std::vector<cv::Point2d> centres;
    cv::RNG random(static_cast<std::uint64_t>(level));
    for (double y = 30 * scale; y < 997 - 30 * scale; y += spacing) {
      for (double x = 30 * scale; x < 1303 - 30 * scale; x += spacing) {
        centres.emplace_back(x + random.uniform(-2.0, 2.0), y + random.uniform(-2.0, 2.0));
      }
    }
    const OrbFeatures features = extract(dots_image(1303, 997, centres, 1.3 * scale), options);
    cv::Point2d sum(0, 0);
    double squares = 0;
    int found = 0;
    for (const cv::Point2d& c : centres) {
      for (const Keypoint& k : features.keypoints) {
        const cv::Point2d error(k.x_px - c.x, k.y_px - c.y);
        if (k.level != level || std::hypot(error.x, error.y) > scale) continue;
        sum += error;
        squares += error.dot(error);
        ++found;
      }
    }
    ASSERT_GT(found, static_cast<int>(centres.size()) * 9 / 10) << "level " << level;
    EXPECT_LT(std::abs(sum.x / found), 0.03 * scale) << "level " << level;
    EXPECT_LT(std::abs(sum.y / found), 0.03 * scale) << "level " << level;
    EXPECT_LT(std::sqrt(squares / found), 0.15 * scale) << "level " << level;
  }
}

/// Errors of positions, in pixels of the level, between two samplings of one scene that differ by a known part of a
/// pixel.
std::vector<double> shift_errors(bool subpixel) {
  constexpr int kFine = 8;  // pixels of the fine scene per pixel of the image
  cv::Mat scene = rectangles_image(400 * kFine, 300 * kFine, 6, 40 * kFine);
  cv::GaussianBlur(scene, scene, cv::Size(), 0.6 * kFine);
  OrbOptions options;
  options.levels = 4;
  options.subpixel = subpixel;
  const std::vector<float> scales = level_scales(options);
  const auto sample = [&](int dx, int dy, int seed) {
    cv::Mat image(298, 398, CV_8UC1);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        image.at<std::uint8_t>(y, x) = scene.at<std::uint8_t>(y * kFine + dy, x * kFine + dx);
      }
    }
    return extract(with_noise(image, 1.5, seed), options);
  };
  const OrbFeatures fixed = sample(0, 0, 1);
  std::vector<double> errors;
  for (const auto& [dx, dy] : {std::pair(4, 0), std::pair(3, 5), std::pair(2, 6), std::pair(5, 1)}) {
    const OrbFeatures moved = sample(dx, dy, dx);
    for (std::size_t i = 0; i < fixed.size(); ++i) {
      const Keypoint& k = fixed.keypoints[i];
      double best = 2.5;  // px of the level; farther ones are other corners
      for (std::size_t j = 0; j < moved.size(); ++j) {
        const Keypoint& m = moved.keypoints[j];
        if (m.level != k.level || hamming_distance(fixed.descriptors[i], moved.descriptors[j]) > 64) continue;
        const double error = std::hypot(m.x_px + dx / 8.0 - k.x_px, m.y_px + dy / 8.0 - k.y_px);
        best = std::min(best, error / scales[k.level]);
      }
      if (best < 2.5) errors.push_back(best);
    }
  }
  return errors;
}

TEST(OrbAccuracy, RefinementReducesTheErrorOfPositions) {
  const std::vector<double> whole = shift_errors(false), refined = shift_errors(true);
  EXPECT_GT(refined.size(), 500u);
  EXPECT_LT(median(refined), 0.2);
  EXPECT_LT(median(refined), 0.5 * median(whole));
}

/// Share of features found again and share of right ones among mutual matches, `a` being carried to `b` by the 2x3
/// matrix.
struct Repeat {
  double found, precision;
};
Repeat compare(const OrbFeatures& a, const OrbFeatures& b, const cv::Matx23d& b_from_a, cv::Size b_size,
               const std::vector<float>& scales) {
  const auto carry = [&](const Keypoint& k) {
    const cv::Vec2d p = b_from_a * cv::Vec3d(k.x_px, k.y_px, 1);
    return cv::Point2d(p[0], p[1]);
  };
  const auto distance = [&](const Keypoint& k, const Keypoint& m) {
    const cv::Point2d p = carry(k);
    return std::hypot(m.x_px - p.x, m.y_px - p.y);
  };
  int visible = 0, found = 0, right = 0;
  for (const Keypoint& k : a.keypoints) {
    if (!cv::Rect(40, 40, b_size.width - 80, b_size.height - 80).contains(cv::Point(carry(k)))) continue;
    ++visible;
    found += std::any_of(b.keypoints.begin(), b.keypoints.end(), [&](const Keypoint& m) {
      return std::abs(int{m.level} - k.level) <= 1 && distance(k, m) < 1.5 * scales[k.level];
    });
  }
  std::vector<Match> matches;
  match_brute_force(a.descriptors, b.descriptors, {.ratio = 0.8f}, matches);
  for (const Match& m : matches) {
    const Keypoint& k = a.keypoints[static_cast<std::size_t>(m.query)];
    right += distance(k, b.keypoints[static_cast<std::size_t>(m.feature)]) < 3 * scales[k.level];
  }
  return {static_cast<double>(found) / visible, static_cast<double>(right) / static_cast<double>(matches.size())};
}

TEST(OrbAccuracy, FeaturesSurviveRotationScaleAndNoise) {
  const cv::Mat scene = rectangles_image(640, 480, 8, 60);
  const OrbOptions options;
  const std::vector<float> scales = level_scales(options);
  const OrbFeatures a = extract(with_noise(scene, 2, 1), options);
  for (const auto& [degrees, factor] : {std::pair(0.0, 1.0), std::pair(20.0, 1.0), std::pair(77.0, 1.0),
                                        std::pair(180.0, 1.0), std::pair(0.0, 0.8), std::pair(-35.0, 1.25)}) {
    const cv::Matx23d warp = cv::getRotationMatrix2D({319.5f, 239.5f}, degrees, factor);
    cv::Mat image;
    cv::warpAffine(scene, image, warp, scene.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
    const Repeat repeat = compare(a, extract(with_noise(image, 2, 2), options), warp, image.size(), scales);
    EXPECT_GT(repeat.found, 0.5) << degrees << " " << factor;
    EXPECT_GT(repeat.precision, 0.9) << degrees << " " << factor;
  }
}

TEST(OrbAccuracy, AQuarterTurnTurnsTheFeatures) {
  const cv::Mat image = rectangles_image(640, 480, 8, 60);
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);  // (x, y) -> (479 - y, x)
  const OrbFeatures a = extract(image, OrbOptions{}), b = extract(turned, OrbOptions{});
  constexpr double kTurn = 2 * std::numbers::pi;
  int same = 0;
  std::vector<double> turns, distances;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint& k = a.keypoints[i];
    for (std::size_t j = 0; j < b.size(); ++j) {
      const Keypoint& m = b.keypoints[j];
      if (m.level != k.level || std::abs(m.x_px - (479 - k.y_px)) > 0.1f || std::abs(m.y_px - k.x_px) > 0.1f) continue;
      ++same;
      turns.push_back(std::abs(std::remainder(m.angle_rad - k.angle_rad - kTurn / 4, kTurn)));
      distances.push_back(hamming_distance(a.descriptors[i], b.descriptors[j]));
      break;
    }
  }
  EXPECT_GT(same, 750);  // the order in which equal scores are taken does not turn
  EXPECT_LT(median(turns), 0.005);
  EXPECT_LT(median(distances), 8);
}

}  // namespace
}  // namespace semvslam
