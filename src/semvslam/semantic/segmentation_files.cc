#include "semvslam/semantic/segmentation_files.h"

#include <fmt/core.h>

#include <array>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "semvslam/data/file_io.h"
#include "semvslam/semantic/coco_region.h"
#include "semvslam/semantic/image_input.h"

namespace semvslam {
namespace fs = std::filesystem;

Result<cv::Mat> read_picture(const fs::path& file) {
  std::vector<std::uint8_t> bytes;
  if (const Status s = read_binary_file(file, bytes); !s) return s.error();
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kInvalidInput, fmt::format("{}: {}", file.string(), e.err)};
  }
  if (image.empty()) return Error{ErrorCode::kInvalidInput, fmt::format("{}: is no readable image", file.string())};
  Result<cv::Mat> bgr = to_bgr8(image);
  if (!bgr) return Error{bgr.error().code, fmt::format("{}: {}", file.string(), bgr.error().message)};
  return bgr;
}

cv::Mat draw_overlay(const cv::Mat& bgr, const Segmentation& segmentation) {
  static const std::array<cv::Scalar, 5> kColours{cv::Scalar(60, 200, 60), cv::Scalar(60, 60, 230),
                                                  cv::Scalar(230, 120, 40), cv::Scalar(40, 200, 230),
                                                  cv::Scalar(200, 60, 200)};
  cv::Mat out = bgr.clone();
  for (std::size_t n = segmentation.instances.size(); n-- > 0;) {  // the best on top
    const Instance& i = segmentation.instances[n];
    const cv::Scalar colour = kColours[n % kColours.size()];
    cv::Mat part = out(i.window), tinted;
    cv::addWeighted(part, 0.55, cv::Mat(part.size(), part.type(), colour), 0.45, 0, tinted);
    tinted.copyTo(part, i.mask);
    cv::rectangle(out, i.box, colour);
    const cv::Point corner(static_cast<int>(i.box.x) + 2, static_cast<int>(i.box.y) + 12);
    cv::putText(out, fmt::format("{} {:.2f}", i.class_name, i.score), corner, cv::FONT_HERSHEY_SIMPLEX, 0.4,
                cv::Scalar::all(255));
  }
  return out;
}

Status write_picture(const fs::path& file, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", image, bytes))
    return Error{ErrorCode::kInternal, fmt::format("{}: cannot be encoded", file.string())};
  return write_file_atomically(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string to_json(const Segmentation& segmentation) {
  nlohmann::json out{
      {"width", segmentation.size.width}, {"height", segmentation.size.height}, {"instances", nlohmann::json::array()}};
  for (const Instance& i : segmentation.instances)
    out["instances"].push_back({{"class", i.class_name},
                                {"role", to_string(i.role)},
                                {"score", i.score},
                                {"box", {i.box.x, i.box.y, i.box.x + i.box.width, i.box.y + i.box.height}},
                                {"pixels", cv::countNonZero(i.mask)},
                                {"segmentation",
                                 {{"size", {segmentation.size.height, segmentation.size.width}},
                                  {"counts", pack_region(i.mask, i.window, segmentation.size)}}}});
  return out.dump(1) + "\n";
}

Status write_segmentation(const fs::path& folder, const std::string& stem, const cv::Mat& bgr,
                          const Segmentation& segmentation) {
  if (Status s = write_picture(folder / (stem + ".overlay.png"), draw_overlay(bgr, segmentation)); !s) return s;
  if (Status s = write_picture(folder / (stem + ".instances.png"), segmentation.labels()); !s) return s;
  return write_file_atomically(folder / (stem + ".json"), to_json(segmentation));
}

}  // namespace semvslam
