#include "semvslam/semantic/segmentation.h"

namespace semvslam {
namespace {

template <typename Wanted>
cv::Mat united(const Segmentation& s, Wanted wanted) {
  cv::Mat out = cv::Mat::zeros(s.size, CV_8UC1);
  for (const Instance& i : s.instances)
    if (wanted(i)) {
      cv::Mat part = out(i.window);
      cv::bitwise_or(part, i.mask, part);
    }
  return out;
}

}  // namespace

cv::Mat Segmentation::mask_of(Role least) const {
  return united(*this, [&](const Instance& i) { return i.role >= least; });
}

cv::Mat Segmentation::mask_of_class(std::string_view class_name) const {
  return united(*this, [&](const Instance& i) { return i.class_name == class_name; });
}

cv::Mat Segmentation::labels() const {
  cv::Mat out = cv::Mat::zeros(size, CV_16UC1);
  for (std::size_t n = instances.size(); n-- > 0;)  // the best is drawn last
    out(instances[n].window).setTo(cv::Scalar(static_cast<double>(n + 1)), instances[n].mask);
  return out;
}

int Segmentation::pixels_of_class(std::string_view class_name) const {
  return cv::countNonZero(mask_of_class(class_name));
}

}  // namespace semvslam
