#include "semvslam/data/image_decode.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace semvslam {
namespace {

Error corrupt(const char* what) { return {ErrorCode::kIo, what}; }
Error wrong_kind(std::string what) { return {ErrorCode::kInvalidInput, std::move(what)}; }

std::uint32_t big_endian_32(const std::uint8_t* p) {
  return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3];
}

constexpr std::uint8_t kPngSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

bool is_png(ByteSpan file) { return file.size() >= 8 && std::equal(kPngSignature, kPngSignature + 8, file.begin()); }

/// The chunks must follow one another up to IEND. libpng as OpenCV uses it returns what it has of a file that breaks
/// off.
bool png_is_whole(ByteSpan file) {
  std::size_t at = 8;
  while (at + 12 <= file.size()) {
    const std::size_t length = big_endian_32(&file[at]);
    if (std::equal(&file[at + 4], &file[at + 8], "IEND")) return true;
    at += 12 + length;
  }
  return false;
}

const char* depth_name(int depth) {
  switch (depth) {
    case CV_8U:
      return "8-bit";
    case CV_16U:
      return "16-bit";
    case CV_32F:
      return "32-bit float";
    default:
      return "an unusual depth";
  }
}

}  // namespace

Status ImageDecoder::check_size(int width_px, int height_px) const {
  if (width_px == expected_.width && height_px == expected_.height) return Status::success();
  return wrong_kind(
      fmt::format("the image is {}x{}, the camera {}x{}", width_px, height_px, expected_.width, expected_.height));
}

Status ImageDecoder::decode(ByteSpan file, cv::Mat& image) {
  if (is_png(file)) {
    if (file.size() < 33) return corrupt("the PNG breaks off in its header");
    const std::uint32_t width = big_endian_32(&file[16]), height = big_endian_32(&file[20]);
    if (width > 1u << 24 || height > 1u << 24) return corrupt("the PNG header is corrupt");
    if (Status s = check_size(static_cast<int>(width), static_cast<int>(height)); !s) return s;
    if (!png_is_whole(file)) return corrupt("the PNG is truncated");
  }
  try {
    const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::uint8_t*>(file.data()));
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) return corrupt("not an image, or a corrupt one");
  return check_size(image.cols, image.rows);
}

Status ImageDecoder::colour_image(ByteSpan file, cv::Mat& gray, cv::Mat* colour) {
  cv::Mat image;
  if (Status s = decode(file, image); !s) return s;
  if (image.depth() != CV_8U)
    return wrong_kind(
        fmt::format("a colour image must have 8 bits per channel, this one is {}", depth_name(image.depth())));
  const int channels = image.channels();
  if (channels == 1) {
    gray = image;
    if (colour) cv::cvtColor(image, *colour, cv::COLOR_GRAY2BGR);
    return Status::success();
  }
  if (channels == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  if (colour) *colour = image;
  return Status::success();
}

Status ImageDecoder::depth_image(ByteSpan file, cv::Mat& depth) {
  cv::Mat image;
  if (Status s = decode(file, image); !s) return s;
  if (image.type() != CV_16UC1 && image.type() != CV_32FC1)
    return wrong_kind(fmt::format("a depth image must be 16-bit with one channel, this one is {} with {}",
                                  depth_name(image.depth()), image.channels()));
  depth = image;
  return Status::success();
}

Status ImageDecoder::label_image(ByteSpan file, cv::Mat& labels) {
  cv::Mat image;
  if (Status s = decode(file, image); !s) return s;
  if (image.type() != CV_8UC1)
    return wrong_kind(fmt::format("a mask must be 8-bit with one channel, this one is {} with {}",
                                  depth_name(image.depth()), image.channels()));
  labels = image;
  return Status::success();
}

}  // namespace semvslam
