#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace semvslam {

/// Bilinear shrinking of 8-bit images by factors up to 4, with the half-pixel convention of cv::resize: pixel areas map
/// onto pixel areas, x_src = (x_dst + 0.5) * (src.cols / dst.cols) - 0.5. Weights have 6 bits; equal on every machine.
class Shrinker {
 public:
  /// @param dst allocated by the caller, not larger than src, which has at least 2x2 pixels.
  void shrink(const cv::Mat& src, cv::Mat& dst);

 private:
  /// Where the pixels of one row (or column) of dst come from: src[first] and src[first + 1], the latter weighted by
  /// second_64.
  struct Axis {
    int src = 0, dst = 0;
    std::vector<int> first;
    std::vector<std::uint8_t> second_64;
    std::vector<std::int8_t> shuffle, weights;  // per pixel two bytes: offsets into 16 bytes, weights
    bool shuffles = false;                      // eight neighbours of dst always come from 16 neighbours of src
    void prepare(int src_size, int dst_size);
  };
  void shrink_row(const std::uint8_t* src, const Axis& axis, std::uint8_t* dst) const;

  std::vector<Axis> x_axes_, y_axes_;  // one per size seen
  std::vector<std::uint8_t> row_;
  static const Axis& axis_for(std::vector<Axis>& axes, int src_size, int dst_size);
};

/// Pixels this near to the border are not written by smooth().
constexpr int kSmoothReach = 3;

/// Smooths with the weights (1 2 3 4 3 2 1) / 16 in both directions (variance 2.5 px^2 each; a Gaussian of 2 px cut off
/// at 7x7, as ORB uses, has 2.7), as rounded averages of averages in 8 bits. They round up, so the result is brighter
/// by about one grey level, which comparisons of smoothed pixels do not see.
class Smoother {
 public:
  /// @param dst allocated by the caller, at least as large as src; pixel (x, y) belongs to pixel (x, y).
  void smooth(const cv::Mat& src, cv::Mat& dst);

 private:
  std::vector<std::uint8_t> row_;
};

}  // namespace semvslam
