// Makes the table of brief_pattern.cc:   learn_brief_pattern [IMAGE...] > table.txt
//
// Which 256 point pairs to compare? Each pair is a bit; the Hamming distance is a sum of bits that differ. A corner is
// found again when its distance to itself in another view is below that of all other corners of the image, and the
// nearest of a thousand others lies about three standard deviations below their mean. So pairs are taken greedily, each
// time the one that raises most the margin between the two:
//   (mean_different - 3 deviation_different) - (mean_same + deviation_same)
// Correlated pairs raise the deviations by their covariance with all taken before, so that decorrelation (the aim of
// Rublee et al., ICCV 2011), information and stability are weighed in one number.
//
// Views: images, and the same images turned, scaled, sheared, with other contrast and noise; the corners are those that
// our extractor finds, with its errors of place and angle. Without arguments the images are "dead leaves" (Lee,
// Mumford, Huang, IJCV 2001): shapes of all sizes covering each other, which have the statistics of natural images. All
// from fixed seeds.
#include <fmt/core.h>

#include <bit>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "semvslam/feature/brief_pattern.h"
#include "semvslam/feature/orb_extractor.h"
#include "semvslam/feature/pyramid_filters.h"

namespace semvslam {
namespace {

constexpr int kRadius = kBriefRadius - 1;  // rotated points are rounded
constexpr int kImages = 48;
constexpr int kCandidates = 40000;
constexpr std::size_t kTests = 256;

std::vector<cv::Point> disc() {
  std::vector<cv::Point> points;
  for (int y = -kRadius; y <= kRadius; ++y) {
    for (int x = -kRadius; x <= kRadius; ++x) {
      if (x * x + y * y <= kRadius * kRadius) points.emplace_back(x, y);
    }
  }
  return points;
}

cv::Mat dead_leaves(cv::RNG& random) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 9000; ++i) {
    // Probability of a size r is proportional to 1 / r^3, from 2 to 200 px: small leaves last, for they would be
    // covered.
    const double u = random.uniform(0.0, 1.0), r = 1 / std::sqrt(1 / 4.0 - u * (1 / 4.0 - 1 / 40000.0));
    const cv::Point2f centre(random.uniform(-20.f, 660.f), random.uniform(-20.f, 500.f));
    const cv::Size2f size(static_cast<float>(r), static_cast<float>(r * random.uniform(0.3, 1.0)));
    const cv::RotatedRect shape(centre, size, random.uniform(0.f, 180.f));
    const cv::Scalar grey(random.uniform(10, 246));
    if (random.uniform(0, 2)) {
      cv::ellipse(image, shape, grey, cv::FILLED, cv::LINE_AA);
    } else {
      std::vector<cv::Point2f> corners(4);
      shape.points(corners.data());
      cv::fillConvexPoly(image, std::vector<cv::Point>(corners.begin(), corners.end()), grey, cv::LINE_AA);
    }
  }
  cv::GaussianBlur(image, image, cv::Size(), random.uniform(0.6, 1.4));
  return image;
}

cv::Mat noisy(const cv::Mat& image, double gain, double sigma, cv::RNG& random) {
  cv::Mat noise(image.size(), CV_32FC1), sum;
  random.fill(noise, cv::RNG::NORMAL, 0, sigma);
  image.convertTo(sum, CV_32F, gain, 128 * (1 - gain));
  sum += noise;
  sum.convertTo(sum, CV_8U);
  return sum;
}

/// Values of the disc's points around every feature, turned back by its angle (in 64 steps).
using Patch = std::vector<std::uint8_t>;
std::vector<Patch> patches_of(const OrbFeatures& features, const std::vector<cv::Mat>& pyramid,
                              const std::vector<cv::Point>& points) {
  std::vector<cv::Mat> smooth;
  for (const cv::Mat& level : pyramid) {
    smooth.push_back(level.clone());
    Smoother().smooth(level, smooth.back());
  }
  std::vector<Patch> patches;
  for (const Keypoint& k : features.keypoints) {
    const cv::Mat& level = smooth[k.level];
    const int x = cvRound((k.x_px + 0.5) * level.cols / pyramid[0].cols - 0.5);
    const int y = cvRound((k.y_px + 0.5) * level.rows / pyramid[0].rows - 0.5);
    const double angle = std::lround(k.angle_rad * 32 / std::numbers::pi) * std::numbers::pi / 32;
    const double c = std::cos(angle), s = std::sin(angle);
    Patch& patch = patches.emplace_back();
    for (const cv::Point& p : points) {
      const cv::Point at(x + static_cast<int>(std::lround(c * p.x - s * p.y)),
                         y + static_cast<int>(std::lround(s * p.x + c * p.y)));
      patch.push_back(level.at<std::uint8_t>(std::clamp(at.y, 0, level.rows - 1), std::clamp(at.x, 0, level.cols - 1)));
    }
  }
  return patches;
}

/// Patches of one corner in two views; entry i of both belongs together.
struct Views {
  std::vector<Patch> first, second;
};

void add_views(const cv::Mat& image, cv::RNG& random, const std::vector<cv::Point>& points, Views& views) {
  cv::Matx23d warp = cv::getRotationMatrix2D({320, 240}, random.uniform(-40.0, 40.0), random.uniform(0.8, 1.25));
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) warp(i, j) += random.uniform(-0.08, 0.08);
  }
  cv::Mat turned;
  cv::warpAffine(image, turned, warp, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  OrbExtractor extractor{OrbOptions{}};
  const std::vector<float> scales = level_scales(extractor.options());
  OrbFeatures a, b;
  extractor.extract(noisy(image, 1, random.uniform(1.0, 4.0), random), {}, a);
  const std::vector<Patch> first = patches_of(a, extractor.pyramid(), points);
  extractor.extract(noisy(turned, random.uniform(0.7, 1.2), random.uniform(1.0, 4.0), random), {}, b);
  const std::vector<Patch> second = patches_of(b, extractor.pyramid(), points);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const cv::Vec2d at = warp * cv::Vec3d(a.keypoints[i].x_px, a.keypoints[i].y_px, 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const Keypoint& k = b.keypoints[j];
      if (std::abs(k.level - a.keypoints[i].level) > 1 ||
          std::hypot(k.x_px - at[0], k.y_px - at[1]) > 1.5 * scales[k.level])
        continue;
      views.first.push_back(first[i]);
      views.second.push_back(second[j]);
      break;
    }
  }
}

using Bits = std::vector<std::uint64_t>;

std::size_t count_ones(const Bits& a) {
  std::size_t n = 0;
  for (const std::uint64_t w : a) n += static_cast<std::size_t>(std::popcount(w));
  return n;
}

double common_ones(const Bits& a, const Bits& b) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) n += static_cast<std::size_t>(std::popcount(a[i] & b[i]));
  return static_cast<double>(n);
}

struct Candidate {
  int a, b;
  Bits same, different;  // per pair of patches: does the bit differ?
  double mean_same, mean_different;
  double with_same = 0, with_different = 0;  // covariance with the sum of the taken tests
};

std::vector<Candidate> make_candidates(const Views& views, const std::vector<cv::Point>& points, cv::RNG& random) {
  const std::size_t n = views.first.size(), words = (n + 63) / 64;
  std::vector<Candidate> candidates;
  while (candidates.size() < kCandidates) {
    const int a = random.uniform(0, static_cast<int>(points.size())),
              b = random.uniform(0, static_cast<int>(points.size()));
    const cv::Point d = points[static_cast<std::size_t>(a)] - points[static_cast<std::size_t>(b)];
    if (d.dot(d) < 9 || a == b) continue;
    Candidate c{a, b, Bits(words), Bits(words), 0, 0};
    const auto bit = [&](const Patch& p) { return p[static_cast<std::size_t>(a)] < p[static_cast<std::size_t>(b)]; };
    for (std::size_t i = 0; i < n; ++i) {
      const bool first = bit(views.first[i]);
      // 7919 places on: another image, as a rule.
      c.same[i / 64] |= static_cast<std::uint64_t>(first != bit(views.second[i])) << (i % 64);
      c.different[i / 64] |= static_cast<std::uint64_t>(first != bit(views.second[(i + 7919) % n])) << (i % 64);
    }
    c.mean_same = static_cast<double>(count_ones(c.same)) / static_cast<double>(n);
    c.mean_different = static_cast<double>(count_ones(c.different)) / static_cast<double>(n);
    candidates.push_back(std::move(c));
  }
  return candidates;
}

std::vector<std::size_t> choose(std::vector<Candidate>& candidates, std::size_t n) {
  std::vector<std::size_t> chosen;
  double gap = 0, spread_same = 0, spread_different = 0;
  while (chosen.size() < kTests) {
    std::size_t best = 0;
    double best_margin = -1e9;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const Candidate& c = candidates[i];
      const double same = spread_same + 2 * c.with_same + c.mean_same * (1 - c.mean_same);
      const double different = spread_different + 2 * c.with_different + c.mean_different * (1 - c.mean_different);
      const double margin = gap + c.mean_different - c.mean_same - 3 * std::sqrt(different) - std::sqrt(same);
      if (margin > best_margin) {
        best_margin = margin;
        best = i;
      }
    }
    const Candidate taken = std::move(candidates[best]);
    candidates[best].mean_different = -1e9;  // never again
    gap += taken.mean_different - taken.mean_same;
    spread_same += 2 * taken.with_same + taken.mean_same * (1 - taken.mean_same);
    spread_different += 2 * taken.with_different + taken.mean_different * (1 - taken.mean_different);
    chosen.push_back(best);
    candidates[best].a = taken.a;
    candidates[best].b = taken.b;
    for (Candidate& c : candidates) {
      if (c.same.empty()) continue;
      c.with_same += common_ones(c.same, taken.same) / static_cast<double>(n) - c.mean_same * taken.mean_same;
      c.with_different +=
          common_ones(c.different, taken.different) / static_cast<double>(n) - c.mean_different * taken.mean_different;
    }
    if (chosen.size() % 32 == 0) fmt::print(stderr, "{} tests: margin {:.2f} bits\n", chosen.size(), best_margin);
  }
  return chosen;
}

int learn(const std::vector<std::string>& paths) {
  const std::vector<cv::Point> points = disc();
  cv::RNG random(20);
  Views views;
  for (std::size_t i = 0; i < (paths.empty() ? kImages : paths.size()); ++i) {
    const cv::Mat image = paths.empty() ? dead_leaves(random) : cv::imread(paths[i], cv::IMREAD_GRAYSCALE);
    if (image.empty()) {
      fmt::print(stderr, "{}: not an image that can be read\n", paths[i]);
      return 1;
    }
    add_views(image, random, points, views);
  }
  fmt::print(stderr, "{} corners in two views\n", views.first.size());
  std::vector<Candidate> candidates = make_candidates(views, points, random);
  for (const std::size_t i : choose(candidates, views.first.size())) {
    const cv::Point a = points[static_cast<std::size_t>(candidates[i].a)],
                    b = points[static_cast<std::size_t>(candidates[i].b)];
    fmt::print("{{{}, {}, {}, {}}},\n", a.x, a.y, b.x, b.y);
  }
  return 0;
}

}  // namespace
}  // namespace semvslam

int main(int argc, char** argv) { return semvslam::learn({argv + 1, argv + argc}); }
