#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace semvslam {

/// Images of which each frame needs new ones, because others may still read those of the frames before. An image comes
/// back by itself: once nobody else holds it, take() gives its memory out again. The system would map fresh pages for
/// each, which costs more than filling them.
///
/// take() belongs to one thread; images may be read and let go on any.
class ImagePool {
 public:
  /// @return an image that nobody else holds; what is in it is anything.
  cv::Mat take(cv::Size size, int type);
  cv::Mat take_zeros(cv::Size size, int type);

  /// So many images are kept at most; those beyond are ordinary ones.
  static constexpr std::size_t kMost = 96;
  std::size_t kept() const { return images_.size(); }

 private:
  std::vector<cv::Mat> images_;
};

}  // namespace semvslam
