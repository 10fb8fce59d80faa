#include "semvslam/geometry/mask_growth.h"

#include <opencv2/imgproc.hpp>

namespace semvslam {
namespace {

cv::Mat square(int reach_px) { return cv::getStructuringElement(cv::MORPH_RECT, {2 * reach_px + 1, 2 * reach_px + 1}); }

/// The part of the image within reach of a pixel that is set; empty where none is.
cv::Rect reach_of(const cv::Mat& mask, int reach_px) {
  const cv::Rect set = cv::boundingRect(mask);
  if (set.empty()) return {};
  const cv::Point reach(reach_px, reach_px);
  return cv::Rect(set.tl() - reach, set.br() + reach) & cv::Rect(cv::Point(), mask.size());
}

}  // namespace

void grow_mask(cv::Mat& mask, int reach_px) {
  if (reach_px <= 0) return;
  const cv::Rect set = reach_of(mask, reach_px);
  if (set.empty()) return;
  cv::Mat part = mask(set);
  cv::dilate(part, part, square(reach_px));
}

void add_grown(cv::Mat& target, const cv::Mat& mask, int reach_px) {
  const cv::Rect set = mask.empty() ? cv::Rect() : reach_of(mask, reach_px);
  if (set.empty()) return;
  cv::Mat grown, part = target(set);
  cv::dilate(mask(set), grown, square(reach_px));
  cv::bitwise_or(part, grown, part);
}

void without_rim(const cv::Mat& mask, int rim_px, cv::Mat& inside) {
  if (rim_px <= 0) {
    mask.copyTo(inside);
    return;
  }
  inside.setTo(0);
  const cv::Rect set = reach_of(mask, rim_px);
  if (set.empty()) return;
  cv::Mat part = inside(set);
  cv::erode(mask(set), part, square(rim_px));
}

}  // namespace semvslam
