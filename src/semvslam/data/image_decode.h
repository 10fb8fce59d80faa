#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "semvslam/base/result.h"
#include "semvslam/data/jpeg_decode.h"
#include "semvslam/data/png_decode.h"
#include "semvslam/geometry/image_pool.h"

namespace semvslam {

/// Turns the bytes of image files into images. Plain PNG and JPEG files are decoded by PngDecoder and JpegDecoder, all
/// else (interlaced PNG, TIFF, WebP, PGM...) by OpenCV. Keeps scratch memory between images: one decoder per thread.
/// All calls: errors say what is wrong with the image in a few words, without its name (the caller knows it): truncated
/// or corrupt data, a size other than `expected`, the wrong number of bits or channels. Sizes are checked before
/// anything is decoded, so a PNG or JPEG of some bytes cannot claim gigabytes. The results are images of their own: the
/// decoder writes into one again only when nobody else holds it any more.
class ImageDecoder {
 public:
  explicit ImageDecoder(cv::Size expected) : expected_(expected) {}

  /// An 8-bit colour or grey image.
  /// @param gray CV_8UC1, always given: of JPEG the luma plane, of others 0.299 R + 0.587 G + 0.114 B as cv::cvtColor;
  /// it does not depend on whether colour is wanted. @param colour CV_8UC3 BGR, only where not null.
  Status colour_image(ByteSpan file, cv::Mat& gray, cv::Mat* colour);
  /// A depth image: CV_16UC1, or CV_32FC1 (metres) from formats that have floats.
  Status depth_image(ByteSpan file, cv::Mat& depth);
  /// A single-channel 8-bit image: CV_8UC1, the numbers as they are in the file (the index, of a palette PNG).
  Status label_image(ByteSpan file, cv::Mat& labels);

 private:
  Status check_size(cv::Size size) const;
  /// Images of the expected size, for the decoding to write into. @param colour may be null.
  void take_images(cv::Mat& gray, cv::Mat* colour);
  /// The pixels of a PNG that our decoder reads; nothing when OpenCV has to do it.
  Result<std::optional<PngPixels>> decode_png(ByteSpan file);
  /// By OpenCV; any format, any type.
  Status decode_other(ByteSpan file, cv::Mat& image);
  cv::Size expected_;
  PngDecoder png_;
  JpegDecoder jpeg_;
  ImagePool images_;
};

}  // namespace semvslam
