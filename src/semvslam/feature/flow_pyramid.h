#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace semvslam {

/// Columns of a patch of that width in whole blocks of 16, which vector registers hold: what lies behind the patch in
/// its last block is read as well, with weight zero.
constexpr int patch_lanes(int window_px) { return (window_px + 15) / 16 * 16; }

/// An 8-bit image and its smaller versions, each with a margin around it (mirrored at the border, which itself is not
/// repeated), so that patches may reach over the border. Pixel (x, y) of a level lies at (2x, 2y) of the one below.
/// The memory is kept: building anew with images of one size allocates nothing.
class FlowPyramid {
 public:
  /// Smooths with the weights (1 4 6 4 1) / 16 in both directions before it takes every second pixel; integers, one
  /// result on every machine. @param gray CV_8UC1, copied. @param levels above the image; fewer are made where they
  /// would be no larger than the patch. @param window_px side of the patches that are compared, sets the margin.
  void build(const cv::Mat& gray, int levels, int window_px);

  bool empty() const { return levels_.empty(); }
  /// Above the image itself.
  int top() const { return static_cast<int>(levels_.size()) - 1; }
  /// Level 0 is the image. Readable for margin_px() pixels beyond all sides.
  const cv::Mat& level(int index) const { return levels_[static_cast<std::size_t>(index)]; }
  int margin_px() const { return margin_px_; }

 private:
  void half_sample(const cv::Mat& src, cv::Mat& dst);

  int margin_px_ = 0;
  std::vector<cv::Mat> levels_, padded_;  // views into the padded ones
  std::vector<std::uint16_t> column_;
};

}  // namespace semvslam
