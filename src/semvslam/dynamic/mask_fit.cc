#include "semvslam/dynamic/mask_fit.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "semvslam/geometry/depth_image.h"
#include "semvslam/geometry/mask_growth.h"

namespace semvslam {
namespace {

constexpr float kLeastShare = 0.02f;  // of the window that must be thing with depth, to say how far away it is

/// The first x >= `from` whose value is 255, or `end`.
int next_set(const std::uint8_t* row, int from, int end) {
  const void* at = std::memchr(row + from, 255, static_cast<std::size_t>(end - from));
  return at != nullptr ? static_cast<int>(static_cast<const std::uint8_t*>(at) - row) : end;
}

}  // namespace

void fit_to_depth(cv::Mat& mask, const cv::Mat& depth, float metres_per_unit, const MaskFitOptions& options) {
  const int half_band = options.band_px / 2;
  if (depth.empty() || depth.size() != mask.size() || half_band < 1) return;
  const cv::Rect set = cv::boundingRect(mask);
  if (set.empty()) return;
  // In half size, of the part of the image that the mask, its band and the averages over it reach.
  const int side = options.reach_px / 2 | 1;
  const int room = half_band + side / 2 + 1;
  const cv::Rect image({}, cv::Size((mask.cols + 1) / 2, (mask.rows + 1) / 2));
  const cv::Rect window = cv::Rect(cv::Point(set.x / 2 - room, set.y / 2 - room),
                                   cv::Point((set.br().x + 1) / 2 + room, (set.br().y + 1) / 2 + room)) &
                          image;
  const cv::Mat depth_m = half_depth_m(depth, metres_per_unit, window);
  cv::Mat thing(window.size(), CV_8UC1), inside_m(window.size(), CV_32FC1), inside(window.size(), CV_32FC1);
  for (int y = 0; y < window.height; ++y) {
    const std::uint8_t* from = mask.ptr<std::uint8_t>(2 * (window.y + y)) + 2 * window.x;
    std::uint8_t* things = thing.ptr<std::uint8_t>(y);
    for (int x = 0; x < window.width; ++x) things[x] = from[2 * x] != 0 ? 255 : 0;
  }
  // The thing's own depth comes from its core: the rim of a mask may lie on what is behind it.
  cv::Mat core(thing.size(), CV_8UC1), widest = thing.clone();
  without_rim(thing, half_band, core);
  grow_mask(widest, half_band);
  for (int y = 0; y < window.height; ++y) {
    const std::uint8_t* cores = core.ptr<std::uint8_t>(y);
    const float* depths = depth_m.ptr<float>(y);
    float *counts = inside.ptr<float>(y), *metres = inside_m.ptr<float>(y);
    for (int x = 0; x < window.width; ++x) {
      const bool counted = depths[x] > 0 && cores[x] != 0;
      counts[x] = counted ? 1.f : 0.f;
      metres[x] = counted ? depths[x] : 0.f;
    }
  }
  cv::boxFilter(inside, inside, -1, {side, side});
  cv::boxFilter(inside_m, inside_m, -1, {side, side});
  cv::Mat band;
  cv::bitwise_xor(widest, core, band);  // the core lies within
  for (int y = 0; y < window.height; ++y) {
    const std::uint8_t *bands = band.ptr<std::uint8_t>(y), *things = thing.ptr<std::uint8_t>(y);
    const float *depths = depth_m.ptr<float>(y), *shares = inside.ptr<float>(y), *metres = inside_m.ptr<float>(y);
    const int to_y = 2 * (window.y + y), end_y = std::min(to_y + 2, mask.rows);
    for (int x = next_set(bands, 0, window.width); x < window.width; x = next_set(bands, x + 1, window.width)) {
      if (depths[x] <= 0 || shares[x] < kLeastShare) continue;
      const bool belongs = std::abs(depths[x] - metres[x] / shares[x]) < static_cast<float>(options.tolerance_m);
      if (belongs == (things[x] != 0)) continue;
      const int to_x = 2 * (window.x + x), end_x = std::min(to_x + 2, mask.cols);
      for (int v = to_y; v < end_y; ++v)
        for (int u = to_x; u < end_x; ++u) mask.at<std::uint8_t>(v, u) = belongs ? 255 : 0;
    }
  }
}

}  // namespace semvslam
