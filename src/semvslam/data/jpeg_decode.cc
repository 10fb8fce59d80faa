#include "semvslam/data/jpeg_decode.h"

#include <turbojpeg.h>

#include <opencv2/imgproc.hpp>
#include <string_view>

namespace semvslam {
namespace {

// The accurate transform is OpenCV's default as well, and hardly slower with SIMD. Limited scans: a progressive file
// can demand hours with thousands of them.
constexpr int kFlags = TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS;

}  // namespace

struct JpegDecoder::Handle {
  tjhandle turbo = tjInitDecompress();
  ~Handle() {
    if (turbo) tjDestroy(turbo);
  }

  /// After a call that failed or warned: is the picture good all the same? Bytes between segments harm nothing; all
  /// other warnings (premature end, corrupt data) mean that a part of the picture is missing or wrong.
  Status status(int returned) const {
    if (returned == 0) return Status::success();
    const std::string_view message = tjGetErrorStr2(turbo);
    if (tjGetErrorCode(turbo) == TJERR_WARNING && message.find("extraneous bytes") != std::string_view::npos)
      return Status::success();
    if (message.find("remature end") != std::string_view::npos)
      return Error{ErrorCode::kInvalidInput, "the JPEG is truncated"};
    return Error{ErrorCode::kInvalidInput,
                 "the JPEG is corrupt (" + std::string(message.substr(0, message.find('\n'))) + ")"};
  }
};

JpegDecoder::JpegDecoder() : handle_(std::make_unique<Handle>()) {}
JpegDecoder::~JpegDecoder() = default;
JpegDecoder::JpegDecoder(JpegDecoder&&) noexcept = default;
JpegDecoder& JpegDecoder::operator=(JpegDecoder&&) noexcept = default;

bool is_jpeg(ByteSpan file) { return file.size() >= 3 && file[0] == 0xFF && file[1] == 0xD8 && file[2] == 0xFF; }

Result<JpegDecoder::Header> JpegDecoder::read_header(ByteSpan file) {
  Header h;
  if (Status s = handle_->status(tjDecompressHeader3(handle_->turbo, file.data(), file.size(), &h.width, &h.height,
                                                     &h.subsampling, &h.colourspace));
      !s)
    return s.error();
  // Other colour spaces have no luma plane; samplings beyond the usual ones no plane layout in TurboJPEG.
  if (h.subsampling < 0 || (h.colourspace != TJCS_YCbCr && h.colourspace != TJCS_GRAY))
    return Error{ErrorCode::kUnsupported, "JPEG of an unusual kind"};
  return h;
}

Result<cv::Size> JpegDecoder::size(ByteSpan file) {
  const Result<Header> header = read_header(file);
  if (!header) return header.error();
  return cv::Size(header->width, header->height);
}

Status JpegDecoder::decode_planes(ByteSpan file, const Header& h) {
  unsigned char* first[3] = {};
  int strides[3] = {};
  const int count = h.subsampling == TJSAMP_GRAY ? 1 : 3;
  for (int i = 0; i < count; ++i) {
    planes_[i].create(tjPlaneHeight(i, h.height, h.subsampling), tjPlaneWidth(i, h.width, h.subsampling), CV_8UC1);
    first[i] = planes_[i].data;
    strides[i] = static_cast<int>(planes_[i].step);
  }
  return handle_->status(
      tjDecompressToYUVPlanes(handle_->turbo, file.data(), file.size(), first, h.width, strides, h.height, kFlags));
}

Status JpegDecoder::decode(ByteSpan file, cv::Mat& gray, cv::Mat* bgr) {
  const Result<Header> header = read_header(file);
  if (!header) return header.error();
  const Header& h = *header;
  if (!bgr) {  // luma alone, straight into the picture
    gray.create(h.height, h.width, CV_8UC1);
    return handle_->status(tjDecompress2(handle_->turbo, file.data(), file.size(), gray.data, h.width,
                                         static_cast<int>(gray.step), h.height, TJPF_GRAY, kFlags));
  }
  if (Status s = decode_planes(file, h); !s) return s;
  planes_[0](cv::Rect(0, 0, h.width, h.height)).copyTo(gray);
  if (h.subsampling == TJSAMP_GRAY) {
    cv::cvtColor(gray, *bgr, cv::COLOR_GRAY2BGR);
    return Status::success();
  }
  bgr->create(h.height, h.width, CV_8UC3);
  const unsigned char* first[3] = {planes_[0].data, planes_[1].data, planes_[2].data};
  const int strides[3] = {static_cast<int>(planes_[0].step), static_cast<int>(planes_[1].step),
                          static_cast<int>(planes_[2].step)};
  return handle_->status(tjDecodeYUVPlanes(handle_->turbo, first, strides, h.subsampling, bgr->data, h.width,
                                           static_cast<int>(bgr->step), h.height, TJPF_BGR, kFlags));
}

}  // namespace semvslam
