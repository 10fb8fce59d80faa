#include "semvslam/semantic/segmentation.h"

#include <map>
#include <utility>

namespace semvslam {
namespace {

/// @param view of the image, to be drawn; must hold all that is wanted.
template <typename Wanted>
cv::Mat united(const Segmentation& s, const cv::Rect& view, Wanted wanted) {
  cv::Mat out = cv::Mat::zeros(view.size(), CV_8UC1);
  for (const Instance& i : s.instances)
    if (wanted(i)) {
      cv::Mat part = out(i.window - view.tl());
      cv::bitwise_or(part, i.mask, part);
    }
  return out;
}

}  // namespace

cv::Mat Segmentation::mask_of(Role least) const {
  return united(*this, {{}, size}, [&](const Instance& i) { return i.role >= least; });
}

cv::Mat Segmentation::mask_of_class(std::string_view class_name) const {
  return united(*this, {{}, size}, [&](const Instance& i) { return i.class_name == class_name; });
}

cv::Mat Segmentation::labels() const {
  cv::Mat out = cv::Mat::zeros(size, CV_16UC1);
  for (std::size_t n = instances.size(); n-- > 0;)  // the best is drawn last
    out(instances[n].window).setTo(cv::Scalar(static_cast<double>(n + 1)), instances[n].mask);
  return out;
}

std::vector<ClassMask> Segmentation::class_masks() const {
  const cv::Mat instance_of_pixel = labels();
  std::map<int, std::pair<std::string, cv::Mat>> classes;
  for (std::size_t n = 0; n < instances.size(); ++n) {
    auto& [name, mask] = classes[instances[n].class_index];
    if (mask.empty()) name = instances[n].class_name, mask = cv::Mat::zeros(size, CV_8UC1);
    mask(instances[n].window).setTo(255, instance_of_pixel(instances[n].window) == static_cast<double>(n + 1));
  }
  std::vector<ClassMask> out;
  for (const auto& [index, named] : classes)
    if (MaskRuns pixels(named.second); pixels.is_set_anywhere()) out.push_back({index, named.first, std::move(pixels)});
  return out;
}

int Segmentation::pixels_of_class(std::string_view class_name) const {
  const auto wanted = [&](const Instance& i) { return i.class_name == class_name; };
  cv::Rect view;
  for (const Instance& i : instances)
    if (wanted(i)) view |= i.window;
  return view.empty() ? 0 : cv::countNonZero(united(*this, view, wanted));
}

}  // namespace semvslam
