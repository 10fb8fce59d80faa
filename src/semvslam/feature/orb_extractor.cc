#include "semvslam/feature/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "semvslam/feature/brief_pattern.h"
#include "semvslam/feature/corner_refinement.h"
#include "semvslam/feature/corner_selection.h"
#include "semvslam/feature/fast_corners.h"
#include "semvslam/feature/oriented_brief.h"
#include "semvslam/feature/pyramid_filters.h"

namespace semvslam {
namespace {

constexpr int kBorder = kPatchRadius + kSmoothReach;  // a corner's smoothed patch lies inside the level
constexpr int kMinSide = 64;                          // of the image
static_assert(kBriefRadius <= kPatchRadius && kRefineMargin <= kBorder);

/// Whether a position of a level (continuous, pixel centres at integers) falls on a set pixel of the mask of level 0.
bool is_masked(const cv::Mat& mask, const cv::Size& level, float x, float y) {
  const float x_ratio = static_cast<float>(mask.cols) / static_cast<float>(level.width);
  const float y_ratio = static_cast<float>(mask.rows) / static_cast<float>(level.height);
  const int mx = std::min(static_cast<int>((x + 0.5f) * x_ratio), mask.cols - 1);
  const int my = std::min(static_cast<int>((y + 0.5f) * y_ratio), mask.rows - 1);
  return mask.ptr<std::uint8_t>(my)[mx] != 0;
}

}  // namespace

std::vector<float> level_scales(const OrbOptions& options) {
  std::vector<float> scales;
  for (int l = 0; l < options.levels; ++l) scales.push_back(static_cast<float>(std::pow(options.scale_factor, l)));
  return scales;
}

struct OrbExtractor::Impl {
  explicit Impl(const OrbOptions& o) : options(o), scales(level_scales(o)), selector(o.cell_px) {}

  void build_pyramid(const cv::Mat& gray);
  void detect(std::size_t level, const cv::Mat& mask);
  void share_budget();
  void describe_level(std::size_t level, const cv::Mat& mask, OrbFeatures& out);

  OrbOptions options;
  std::vector<float> scales;
  std::vector<cv::Size> sizes;  // of the levels of the present image
  std::vector<cv::Mat> pyramid;
  Shrinker shrinker;
  Smoother smoother;
  cv::Mat smooth;  // of one level at a time, with the size of level 0: one row stride for all
  OrientedBrief brief;
  cv::Mat taken;                  // pixels of the present level that have a feature already; else 0
  std::vector<cv::Point> places;  // of those
  FastDetector fast;
  std::vector<std::vector<Corner>> corners;  // per level
  std::vector<Corner> selected;
  std::vector<int> budget;  // corners to take per level
  std::vector<bool> full;   // levels that have no more corners to give
  CornerSelector selector;
};

/// Level l has round(size / scale^l) pixels. Every resize maps pixel AREAS onto each other, so in continuous
/// coordinates (pixel centre + 0.5) level and image differ by the ratio of their sizes exactly, also through a chain of
/// resizes.
void OrbExtractor::Impl::build_pyramid(const cv::Mat& gray) {
  sizes.clear();
  for (const float scale : scales) {
    const cv::Size size(cvRound(static_cast<float>(gray.cols) / scale), cvRound(static_cast<float>(gray.rows) / scale));
    if (size.width <= 2 * kBorder || size.height <= 2 * kBorder) break;
    sizes.push_back(size);
  }
  const std::size_t usable = sizes.size();
  pyramid.resize(usable);
  for (std::size_t l = 0; l < usable; ++l) {
    if (l == 0) {
      pyramid[0] = gray;
    } else {
      pyramid[l].create(sizes[l], CV_8UC1);
      shrinker.shrink(pyramid[l - 1], pyramid[l]);
    }
  }
}

void OrbExtractor::Impl::detect(std::size_t level, const cv::Mat& mask) {
  const cv::Mat& image = pyramid[level];
  std::vector<Corner>& found = corners[level];
  found.clear();
  fast.detect(image, kBorder, std::min(options.fast_threshold_low, options.fast_threshold), found);
  if (!mask.empty()) {
    std::erase_if(found, [&](const Corner& c) { return is_masked(mask, image.size(), c.x, c.y); });
  }
  selector.drop_weak(found, image.cols, image.rows, options.fast_threshold);
}

/// Levels get shares in proportion to 1 / scale (Rublee et al.); what a level cannot fill goes to the others.
void OrbExtractor::Impl::share_budget() {
  const std::size_t levels = pyramid.size();
  budget.assign(levels, 0);
  int left = options.features;
  full.assign(levels, false);
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

void OrbExtractor::Impl::describe_level(std::size_t level, const cv::Mat& mask, OrbFeatures& out) {
  const cv::Mat& image = pyramid[level];
  // Some corners are moved onto one another or onto the mask; others stand in for them.
  const int spare = options.subpixel ? budget[level] / 8 + 8 : 0;
  selector.select(corners[level], image.cols, image.rows, budget[level], spare, selected);
  if (selected.empty()) return;
  smoother.smooth(image, smooth);
  const float x_ratio = static_cast<float>(pyramid[0].cols) / static_cast<float>(image.cols);
  const float y_ratio = static_cast<float>(pyramid[0].rows) / static_cast<float>(image.rows);
  const auto stride = static_cast<std::ptrdiff_t>(image.step[0]);
  const cv::Rect inside(kBorder, kBorder, image.cols - 2 * kBorder, image.rows - 2 * kBorder);
  for (const Corner& c : selected) {
    if (static_cast<int>(places.size()) == budget[level]) break;
    const RefinedCorner r = options.subpixel ? refine_corner(image, c.x, c.y, inside) : RefinedCorner{c.x, c.y, 0, 0};
    const float x = static_cast<float>(r.x) + r.dx_px, y = static_cast<float>(r.y) + r.dy_px;
    std::uint8_t& occupied = taken.ptr<std::uint8_t>(r.y)[r.x];
    if (occupied != 0 || (!mask.empty() && is_masked(mask, image.size(), x, y))) continue;
    occupied = 1;
    Keypoint k;
    k.x_px = (x + 0.5f) * x_ratio - 0.5f;
    k.y_px = (y + 0.5f) * y_ratio - 0.5f;
    k.response = static_cast<float>(c.score);
    k.level = static_cast<std::uint8_t>(level);
    k.angle_rad = patch_angle_rad(image.ptr<std::uint8_t>(r.y) + r.x, stride);
    out.keypoints.push_back(k);
    out.descriptors.push_back(brief.describe(smooth.ptr<std::uint8_t>(r.y) + r.x, k.angle_rad));
    places.emplace_back(r.x, r.y);
  }
  for (const cv::Point& p : places) taken.at<std::uint8_t>(p) = 0;
  places.clear();
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
  if (gray.cols < kMinSide || gray.rows < kMinSide) return impl_->pyramid.clear();
  impl_->build_pyramid(gray);
  if (impl_->smooth.size() != gray.size()) {
    impl_->smooth.create(gray.size(), CV_8UC1);
    impl_->taken = cv::Mat::zeros(gray.size(), CV_8UC1);
  }
  impl_->brief.set_stride(static_cast<std::ptrdiff_t>(impl_->smooth.step[0]));
  impl_->corners.resize(impl_->pyramid.size());
  for (std::size_t l = 0; l < impl_->pyramid.size(); ++l) impl_->detect(l, mask);
  impl_->share_budget();
  for (std::size_t l = 0; l < impl_->pyramid.size(); ++l) impl_->describe_level(l, mask, out);
}

void OrbExtractor::set_budget(int features) { impl_->options.features = std::max(features, 0); }

const std::vector<cv::Mat>& OrbExtractor::pyramid() const { return impl_->pyramid; }
const OrbOptions& OrbExtractor::options() const { return impl_->options; }

}  // namespace semvslam
