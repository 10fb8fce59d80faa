#include "semvslam/geometry/image_pool.h"

namespace semvslam {
namespace {

/// Whether the pool alone holds it. Adds nothing, but orders what other threads did with the image before they let go.
bool is_free(const cv::Mat& image) { return CV_XADD(&image.u->refcount, 0) == 1; }

}  // namespace

cv::Mat ImagePool::take(cv::Size size, int type) {
  if (size.empty()) return cv::Mat(size, type);
  const auto fits = [&](const cv::Mat& image) { return image.size() == size && image.type() == type; };
  for (const cv::Mat& image : images_)
    if (fits(image) && is_free(image)) return image;
  cv::Mat made(size, type);
  if (images_.size() == kMost) std::erase_if(images_, [&](const cv::Mat& i) { return !fits(i) && is_free(i); });
  if (images_.size() < kMost) images_.push_back(made);
  return made;
}

cv::Mat ImagePool::take_zeros(cv::Size size, int type) {
  cv::Mat image = take(size, type);
  image.setTo(0);
  return image;
}

}  // namespace semvslam
