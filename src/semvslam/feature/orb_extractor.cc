#include "semvslam/feature/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "semvslam/feature/brief_pattern.h"
#include "semvslam/feature/corner_selection.h"

namespace semvslam {
namespace {

constexpr int kPatchRadius = 15;           // of the intensity centroid
constexpr int kBorder = kPatchRadius + 1;  // a corner's patch and its subpixel window lie inside the level
constexpr int kMinSide = 64;               // of the image
constexpr float kTurn = 2 * std::numbers::pi_v<float>;
static_assert(kBriefRadius <= kPatchRadius);

/// Half width of the patch's circle in row dy.
std::array<int, kPatchRadius + 1> circle_half_widths() {
  std::array<int, kPatchRadius + 1> widths{};
  for (int dy = 0; dy <= kPatchRadius; ++dy) {
    widths[static_cast<std::size_t>(dy)] =
        static_cast<int>(std::sqrt((kPatchRadius + 0.5) * (kPatchRadius + 0.5) - dy * dy));
  }
  return widths;
}

/// Direction from the patch's centre to its intensity centroid (Rosin, CVIU 1999), in [0, 2 pi).
float patch_angle_rad(const cv::Mat& image, int x, int y) {
  static const std::array<int, kPatchRadius + 1> widths = circle_half_widths();
  int m01 = 0, m10 = 0;
  for (int dy = -kPatchRadius; dy <= kPatchRadius; ++dy) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y + dy) + x;
    const int half = widths[static_cast<std::size_t>(std::abs(dy))];
    int sum = 0;
    for (int dx = -half; dx <= half; ++dx) {
      sum += row[dx];
      m10 += dx * row[dx];
    }
    m01 += dy * sum;
  }
  const float angle = std::atan2(static_cast<float>(m01), static_cast<float>(m10));
  const float positive = angle < 0 ? angle + kTurn : angle;
  return positive < kTurn ? positive : 0.f;
}

Descriptor describe(const cv::Mat& blurred, int x, int y, float angle_rad) {
  const float c = std::cos(angle_rad), s = std::sin(angle_rad);
  const std::uint8_t* centre = blurred.ptr<std::uint8_t>(y) + x;
  const auto stride = static_cast<std::ptrdiff_t>(blurred.step[0]);
  const auto at = [&](int px, int py) {
    const auto fx = static_cast<float>(px), fy = static_cast<float>(py);
    const long rx = std::lround(c * fx - s * fy), ry = std::lround(s * fx + c * fy);
    return centre[ry * stride + rx];
  };
  Descriptor descriptor{};
  const auto& tests = brief_pattern();
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const BriefTest& t = tests[i];
    if (at(t.ax, t.ay) < at(t.bx, t.by)) descriptor[i / 64] |= std::uint64_t{1} << (i % 64);
  }
  return descriptor;
}

/// Position of the extremum of the parabola through (-1, a), (0, b), (1, c), within half a pixel.
float parabola_peak(float a, float b, float c) {
  const float curvature = a - 2 * b + c;
  if (!(curvature < 0)) return 0;
  return std::clamp((a - c) / (2 * curvature), -0.5f, 0.5f);
}

/// Harris' corner score over a 7x7 window around each of the 3x3 pixels, then a parabola in x and in y.
cv::Point2f subpixel_offset(const cv::Mat& image, int x, int y) {
  constexpr int kReach = 4;
  float xx[9][9], xy[9][9], yy[9][9];
  for (int j = 0; j < 9; ++j) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y + j - kReach) + x - kReach;
    const std::uint8_t* up = image.ptr<std::uint8_t>(y + j - kReach - 1) + x - kReach;
    const std::uint8_t* down = image.ptr<std::uint8_t>(y + j - kReach + 1) + x - kReach;
    for (int i = 0; i < 9; ++i) {
      const auto gx = static_cast<float>(row[i + 1] - row[i - 1]), gy = static_cast<float>(down[i] - up[i]);
      xx[j][i] = gx * gx;
      xy[j][i] = gx * gy;
      yy[j][i] = gy * gy;
    }
  }
  float score[3][3];
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      float a = 0, b = 0, c = 0;
      for (int v = 0; v < 7; ++v) {
        for (int u = 0; u < 7; ++u) {
          a += xx[j + v][i + u];
          b += xy[j + v][i + u];
          c += yy[j + v][i + u];
        }
      }
      score[j][i] = a * c - b * b - 0.04f * (a + c) * (a + c);
    }
  }
  return {parabola_peak(score[1][0], score[1][1], score[1][2]), parabola_peak(score[0][1], score[1][1], score[2][1])};
}

}  // namespace

std::vector<float> level_scales(const OrbOptions& options) {
  std::vector<float> scales;
  for (int l = 0; l < options.levels; ++l) scales.push_back(static_cast<float>(std::pow(options.scale_factor, l)));
  return scales;
}

struct OrbExtractor::Impl {
  explicit Impl(const OrbOptions& o) : options(o), scales(level_scales(o)) {}

  void build_pyramid(const cv::Mat& gray);
  void detect(std::size_t level, const cv::Mat& mask);
  void share_budget();
  void describe_level(std::size_t level, OrbFeatures& out);

  OrbOptions options;
  std::vector<float> scales;
  std::vector<cv::Mat> pyramid;
  cv::Mat blurred;
  std::vector<cv::KeyPoint> fast;
  std::vector<std::vector<Corner>> corners;  // per level
  std::vector<Corner> selected;
  std::vector<int> budget;  // corners to take per level
  CornerSelector selector;
};

/// Level l has round(size / scale^l) pixels. Every resize maps pixel AREAS onto each other, so in continuous
/// coordinates (pixel centre + 0.5) level and image differ by the ratio of their sizes exactly, also through a chain of
/// resizes.
void OrbExtractor::Impl::build_pyramid(const cv::Mat& gray) {
  std::size_t usable = 0;
  std::vector<cv::Size> sizes;
  for (const float scale : scales) {
    const cv::Size size(cvRound(static_cast<float>(gray.cols) / scale), cvRound(static_cast<float>(gray.rows) / scale));
    if (size.width <= 2 * kBorder || size.height <= 2 * kBorder) break;
    sizes.push_back(size);
    ++usable;
  }
  pyramid.resize(usable);
  for (std::size_t l = 0; l < usable; ++l) {
    if (l == 0) {
      pyramid[0] = gray;
    } else {
      cv::resize(pyramid[l - 1], pyramid[l], sizes[l], 0, 0, cv::INTER_LINEAR);
    }
  }
}

void OrbExtractor::Impl::detect(std::size_t level, const cv::Mat& mask) {
  const cv::Mat& image = pyramid[level];
  std::vector<Corner>& found = corners[level];
  found.clear();
  const cv::Rect inside(kBorder - 3, kBorder - 3, image.cols - 2 * (kBorder - 3), image.rows - 2 * (kBorder - 3));
  const int low = std::min(options.fast_threshold_low, options.fast_threshold);
  cv::FAST(image(inside), fast, low, true);
  const double x_ratio = static_cast<double>(pyramid[0].cols) / image.cols;
  const double y_ratio = static_cast<double>(pyramid[0].rows) / image.rows;
  for (const cv::KeyPoint& k : fast) {
    const int x = static_cast<int>(k.pt.x) + inside.x, y = static_cast<int>(k.pt.y) + inside.y;
    if (!mask.empty()) {
      const int mx = std::min(static_cast<int>((x + 0.5) * x_ratio), mask.cols - 1);
      const int my = std::min(static_cast<int>((y + 0.5) * y_ratio), mask.rows - 1);
      if (mask.at<std::uint8_t>(my, mx)) continue;
    }
    found.push_back(
        {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(k.response)});
  }
  selector.drop_weak(found, image.cols, image.rows, options.cell_px, options.fast_threshold);
}

/// Levels get shares in proportion to 1 / scale (Rublee et al.); what a level cannot fill goes to the others.
void OrbExtractor::Impl::share_budget() {
  const std::size_t levels = pyramid.size();
  budget.assign(levels, 0);
  int left = options.features;
  std::vector<bool> full(levels, false);
  while (left > 0) {
    double weight = 0;
    for (std::size_t l = 0; l < levels; ++l) weight += full[l] ? 0 : 1 / scales[l];
    if (weight <= 0) return;
    // Rounding by cumulative sums hands out exactly `left`.
    double cumulated = 0;
    int handed = 0, surplus = 0;
    for (std::size_t l = 0; l < levels; ++l) {
      if (full[l]) continue;
      cumulated += left / (scales[l] * weight);
      const int share = static_cast<int>(std::lround(cumulated)) - handed;
      handed += share;
      budget[l] += share;
      const int excess = budget[l] - static_cast<int>(corners[l].size());
      if (excess >= 0) {
        full[l] = true;
        budget[l] -= excess;
        surplus += excess;
      }
    }
    left = surplus;
  }
}

void OrbExtractor::Impl::describe_level(std::size_t level, OrbFeatures& out) {
  const cv::Mat& image = pyramid[level];
  selector.select(corners[level], image.cols, image.rows, budget[level], selected);
  if (selected.empty()) return;
  cv::GaussianBlur(image, blurred, cv::Size(7, 7), 2, 2, cv::BORDER_REFLECT_101);
  const float x_ratio = static_cast<float>(pyramid[0].cols) / static_cast<float>(image.cols);
  const float y_ratio = static_cast<float>(pyramid[0].rows) / static_cast<float>(image.rows);
  for (const Corner& c : selected) {
    const cv::Point2f offset = options.subpixel ? subpixel_offset(image, c.x, c.y) : cv::Point2f(0, 0);
    Keypoint k;
    k.x_px = (static_cast<float>(c.x) + offset.x + 0.5f) * x_ratio - 0.5f;
    k.y_px = (static_cast<float>(c.y) + offset.y + 0.5f) * y_ratio - 0.5f;
    k.response = static_cast<float>(c.score);
    k.level = static_cast<std::uint8_t>(level);
    k.angle_rad = patch_angle_rad(image, c.x, c.y);
    out.keypoints.push_back(k);
    out.descriptors.push_back(describe(blurred, c.x, c.y, k.angle_rad));
  }
}

OrbExtractor::OrbExtractor(const OrbOptions& options) : impl_(std::make_unique<Impl>(options)) {
  const bool valid = options.features >= 0 && options.levels >= 1 && options.levels <= 32 && options.scale_factor > 1 &&
                     options.scale_factor <= 4 && options.fast_threshold >= 1 && options.fast_threshold <= 254 &&
                     options.fast_threshold_low >= 1 && options.fast_threshold_low <= 254 && options.cell_px >= 8;
  if (!valid) throw std::invalid_argument("OrbExtractor: an option is out of range (see orb_extractor.h)");
}
OrbExtractor::~OrbExtractor() = default;
OrbExtractor::OrbExtractor(OrbExtractor&&) noexcept = default;
OrbExtractor& OrbExtractor::operator=(OrbExtractor&&) noexcept = default;

void OrbExtractor::extract(const cv::Mat& gray, const cv::Mat& mask, OrbFeatures& out) {
  if (!gray.empty() && gray.type() != CV_8UC1) throw std::invalid_argument("OrbExtractor: the image must be CV_8UC1");
  if (!mask.empty() && (mask.type() != CV_8UC1 || mask.size() != gray.size())) {
    throw std::invalid_argument("OrbExtractor: the mask must be CV_8UC1 and as large as the image");
  }
  if (gray.cols > 65535 || gray.rows > 65535)
    throw std::invalid_argument("OrbExtractor: the image is larger than 65535");
  out.keypoints.clear();
  out.descriptors.clear();
  impl_->pyramid.clear();
  if (gray.cols < kMinSide || gray.rows < kMinSide) return;
  impl_->build_pyramid(gray);
  impl_->corners.resize(impl_->pyramid.size());
  for (std::size_t l = 0; l < impl_->pyramid.size(); ++l) impl_->detect(l, mask);
  impl_->share_budget();
  for (std::size_t l = 0; l < impl_->pyramid.size(); ++l) impl_->describe_level(l, out);
}

const std::vector<cv::Mat>& OrbExtractor::pyramid() const { return impl_->pyramid; }
const OrbOptions& OrbExtractor::options() const { return impl_->options; }

}  // namespace semvslam
