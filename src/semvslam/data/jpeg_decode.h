#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/png_decode.h"

namespace semvslam {

/// Decodes baseline and progressive JPEG files with libjpeg-turbo. The grey picture is the file's own luma plane: no
/// colour is computed for it, and it is the same whether colour is asked for or not. The file's chroma is spread over
/// its pixels without smoothing. Not thread-safe; keeps its memory.
class JpegDecoder {
 public:
  JpegDecoder();
  ~JpegDecoder();
  JpegDecoder(JpegDecoder&&) noexcept;
  JpegDecoder& operator=(JpegDecoder&&) noexcept;

  /// Width and height from the header. Errors: no JPEG, kUnsupported (CMYK).
  Result<cv::Size> size(ByteSpan file);
  /// @param gray CV_8UC1. @param bgr CV_8UC3 or null. Errors: kIo for truncated or damaged data, kUnsupported.
  Status decode(ByteSpan file, cv::Mat& gray, cv::Mat* bgr);

 private:
  struct Handle;
  struct Header {
    int width = 0, height = 0, subsampling = 0, colourspace = 0;
  };
  Result<Header> read_header(ByteSpan file);
  Status decode_planes(ByteSpan file, const Header& header);
  std::unique_ptr<Handle> handle_;
  cv::Mat planes_[3];  // luma, blue difference, red difference
};

/// Whether the bytes begin like a JPEG file.
bool is_jpeg(ByteSpan file);

}  // namespace semvslam
