#include "semvslam/dynamic/mask_fit.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "semvslam/geometry/depth_image.h"

namespace semvslam {
namespace {

constexpr float kLeastShare = 0.02f;  // of the window that must be thing with depth, to say how far away it is

}  // namespace

void fit_to_depth(cv::Mat& mask, const cv::Mat& depth, float metres_per_unit, const MaskFitOptions& options) {
  const int half_band = options.band_px / 2;
  if (depth.empty() || depth.size() != mask.size() || half_band < 1) return;
  const cv::Size half((mask.cols + 1) / 2, (mask.rows + 1) / 2);
  cv::Mat thing(half, CV_8UC1), depth_m(half, CV_32FC1), inside_m(half, CV_32FC1), inside(half, CV_32FC1);
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      const float d = depth_at_m(depth, metres_per_unit, 2 * x, 2 * y);
      const bool is_thing = mask.at<std::uint8_t>(2 * y, 2 * x) != 0;
      thing.at<std::uint8_t>(y, x) = is_thing ? 255 : 0;
      depth_m.at<float>(y, x) = d;
    }
  }
  // The thing's own depth comes from its core: the rim of a mask may lie on what is behind it.
  cv::Mat core, widest;
  const cv::Mat element = cv::getStructuringElement(cv::MORPH_RECT, {2 * half_band + 1, 2 * half_band + 1});
  cv::erode(thing, core, element);
  cv::dilate(thing, widest, element);
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      const float d = depth_m.at<float>(y, x);
      const bool counts = d > 0 && core.at<std::uint8_t>(y, x) != 0;
      inside.at<float>(y, x) = counts ? 1.f : 0.f;
      inside_m.at<float>(y, x) = counts ? d : 0.f;
    }
  }
  const int side = options.reach_px / 2 | 1;
  cv::boxFilter(inside, inside, -1, {side, side});
  cv::boxFilter(inside_m, inside_m, -1, {side, side});
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      if (widest.at<std::uint8_t>(y, x) == 0 || core.at<std::uint8_t>(y, x) != 0) continue;
      const float d = depth_m.at<float>(y, x), share = inside.at<float>(y, x);
      if (d <= 0 || share < kLeastShare) continue;
      const bool belongs = std::abs(d - inside_m.at<float>(y, x) / share) < static_cast<float>(options.tolerance_m);
      if (belongs == (thing.at<std::uint8_t>(y, x) != 0)) continue;
      const cv::Rect block(2 * x, 2 * y, std::min(2, mask.cols - 2 * x), std::min(2, mask.rows - 2 * y));
      mask(block).setTo(belongs ? 255 : 0);
    }
  }
}

}  // namespace semvslam
