#include "semvslam/data/image_decode.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace semvslam {
namespace {

const char* bits_name(int cv_depth) {
  switch (cv_depth) {
    case CV_8U:
      return "8-bit";
    case CV_16U:
      return "16-bit";
    case CV_32F:
      return "32-bit float";
    default:
      return "of an unusual depth";
  }
}

Error wrong_kind(const char* wanted, int cv_type) {
  const int channels = CV_MAT_CN(cv_type);
  return {ErrorCode::kInvalidInput, fmt::format("{}, this one is {} with {} channel{}", wanted,
                                                bits_name(CV_MAT_DEPTH(cv_type)), channels, channels == 1 ? "" : "s")};
}

constexpr const char* kWantColour = "a colour image must have 8 bits and 1, 3 or 4 channels";
constexpr const char* kWantDepth = "a depth image must be 16-bit with one channel";
constexpr const char* kWantLabels = "a mask must be 8-bit with one channel";

int type_of(const PngPixels& png) { return CV_MAKETYPE(png.header.bits == 16 ? CV_16U : CV_8U, png.header.channels()); }

/// A Mat header over decoded rows of 8-bit channels.
cv::Mat view_of(const PngPixels& png) {
  return cv::Mat(static_cast<int>(png.header.height_px), static_cast<int>(png.header.width_px), type_of(png),
                 const_cast<std::uint8_t*>(png.first), png.stride);
}

void copy_big_endian_16(const PngPixels& png, cv::Mat& out) {
  out.create(static_cast<int>(png.header.height_px), static_cast<int>(png.header.width_px), CV_16UC1);
  for (int y = 0; y < out.rows; ++y) {
    const std::uint8_t* from = png.first + static_cast<std::size_t>(y) * png.stride;
    std::uint16_t* to = out.ptr<std::uint16_t>(y);
    for (int x = 0; x < out.cols; ++x) to[x] = static_cast<std::uint16_t>(from[2 * x] << 8 | from[2 * x + 1]);
  }
}

bool jpeg_has_end(ByteSpan file) {
  constexpr std::uint8_t kEnd[] = {0xFF, 0xD9};
  return std::find_end(file.begin(), file.end(), std::begin(kEnd), std::end(kEnd)) != file.end();
}

/// Grey and, where wanted, BGR of an 8-bit image whose first channel is red or blue.
Status split_colour(const cv::Mat& image, bool red_first, cv::Mat& gray, cv::Mat* colour) {
  const int channels = image.channels();
  if (image.depth() != CV_8U || channels == 2) return wrong_kind(kWantColour, image.type());
  if (channels == 1) {
    image.copyTo(gray);
    if (colour) cv::cvtColor(image, *colour, cv::COLOR_GRAY2BGR);
    return Status::success();
  }
  const bool alpha = channels == 4;
  cv::cvtColor(image, gray,
               red_first ? (alpha ? cv::COLOR_RGBA2GRAY : cv::COLOR_RGB2GRAY)
                         : (alpha ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY));
  if (!colour) return Status::success();
  if (red_first) {
    cv::cvtColor(image, *colour, alpha ? cv::COLOR_RGBA2BGR : cv::COLOR_RGB2BGR);
  } else if (alpha) {
    cv::cvtColor(image, *colour, cv::COLOR_BGRA2BGR);
  } else {
    image.copyTo(*colour);
  }
  return Status::success();
}

}  // namespace

Status ImageDecoder::check_size(cv::Size size) const {
  if (size == expected_) return Status::success();
  return Error{ErrorCode::kInvalidInput, fmt::format("the image is {}x{}, the camera {}x{}", size.width, size.height,
                                                     expected_.width, expected_.height)};
}

void ImageDecoder::take_images(cv::Mat& gray, cv::Mat* colour) {
  gray = images_.take(expected_, CV_8UC1);
  if (colour) *colour = images_.take(expected_, CV_8UC3);
}

Result<std::optional<PngPixels>> ImageDecoder::decode_png(ByteSpan file) {
  if (!is_png(file)) return std::optional<PngPixels>();
  const Result<PngHeader> header = read_png_header(file);
  if (!header) return header.error();
  if (Status s = check_size({static_cast<int>(header->width_px), static_cast<int>(header->height_px)}); !s)
    return s.error();
  Result<PngPixels> pixels = png_.decode(file);
  if (pixels) return std::optional<PngPixels>(*pixels);
  if (pixels.error().code == ErrorCode::kUnsupported) return std::optional<PngPixels>();
  return pixels.error();
}

Status ImageDecoder::decode_other(ByteSpan file, cv::Mat& image) {
  // Here OpenCV would return what it has of a file that breaks off.
  if (is_png(file) && !png_is_whole(file)) return invalid_input("the PNG is truncated");
  if (is_jpeg(file) && !jpeg_has_end(file)) return invalid_input("the JPEG is truncated");
  try {
    const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::uint8_t*>(file.data()));
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) return invalid_input("not an image, or a corrupt one");
  return check_size(image.size());
}

Status ImageDecoder::colour_image(ByteSpan file, cv::Mat& gray, cv::Mat* colour) {
  gray.release();  // a buffer that the caller may share with an earlier frame is left alone
  if (colour) colour->release();
  if (is_jpeg(file)) {
    const Result<cv::Size> size = jpeg_.size(file);
    if (size) {
      if (Status s = check_size(*size); !s) return s;
      take_images(gray, colour);
      return jpeg_.decode(file, gray, colour);
    }
    if (size.error().code != ErrorCode::kUnsupported) return size.error();
  }
  const Result<std::optional<PngPixels>> png = decode_png(file);
  if (!png) return png.error();
  if (png->has_value() && (*png)->header.colour != PngColour::kPalette) {
    if ((*png)->header.bits != 8) return wrong_kind(kWantColour, type_of(**png));
    take_images(gray, colour);
    return split_colour(view_of(**png), true, gray, colour);
  }
  cv::Mat image;
  if (Status s = decode_other(file, image); !s) return s;
  return split_colour(image, false, gray, colour);
}

Status ImageDecoder::depth_image(ByteSpan file, cv::Mat& depth) {
  depth.release();
  const Result<std::optional<PngPixels>> png = decode_png(file);
  if (!png) return png.error();
  if (png->has_value()) {
    if ((*png)->header.bits != 16) return wrong_kind(kWantDepth, type_of(**png));
    depth = images_.take(expected_, CV_16UC1);
    copy_big_endian_16(**png, depth);
    return Status::success();
  }
  cv::Mat image;
  if (Status s = decode_other(file, image); !s) return s;
  if (image.type() != CV_16UC1 && image.type() != CV_32FC1) return wrong_kind(kWantDepth, image.type());
  depth = image;
  return Status::success();
}

Status ImageDecoder::label_image(ByteSpan file, cv::Mat& labels) {
  labels.release();
  const Result<std::optional<PngPixels>> png = decode_png(file);
  if (!png) return png.error();
  if (png->has_value()) {
    if (type_of(**png) != CV_8UC1) return wrong_kind(kWantLabels, type_of(**png));
    labels = images_.take(expected_, CV_8UC1);
    view_of(**png).copyTo(labels);
    return Status::success();
  }
  cv::Mat image;
  if (Status s = decode_other(file, image); !s) return s;
  if (image.type() != CV_8UC1) return wrong_kind(kWantLabels, image.type());
  labels = image;
  return Status::success();
}

}  // namespace semvslam
