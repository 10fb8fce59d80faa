#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

using ByteSpan = std::span<const std::uint8_t>;

/// Turns the bytes of image files into images. Keeps scratch memory between images: one decoder per thread.
/// All calls: errors say what is wrong with the image in a few words, without its name (the caller knows it): truncated
/// or corrupt data, a size other than `expected`, the wrong number of bits or channels. Sizes are checked before
/// anything is decoded, so a file of some bytes cannot claim gigabytes. The results are new images, never shared with
/// the decoder.
class ImageDecoder {
 public:
  explicit ImageDecoder(cv::Size expected) : expected_(expected) {}

  /// An 8-bit colour or grey image.
  /// @param gray CV_8UC1, always given. @param colour CV_8UC3 BGR, only where not null.
  Status colour_image(ByteSpan file, cv::Mat& gray, cv::Mat* colour);
  /// A depth image: CV_16UC1, or CV_32FC1 (metres) from formats that have floats.
  Status depth_image(ByteSpan file, cv::Mat& depth);
  /// A single-channel 8-bit image: CV_8UC1, the numbers as they are in the file (palette images are not expanded).
  Status label_image(ByteSpan file, cv::Mat& labels);

 private:
  Status check_size(int width_px, int height_px) const;
  Status decode(ByteSpan file, cv::Mat& image);
  cv::Size expected_;
};

}  // namespace semvslam
