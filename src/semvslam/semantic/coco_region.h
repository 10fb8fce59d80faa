#pragma once

#include <nlohmann/json_fwd.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace semvslam {

/// A region of an image as the COCO data set writes it: polygons, or run lengths of alternating background and object,
/// column by column. Kept as written and made into pixels when asked for.
struct CocoRegion {
  std::vector<std::vector<double>> polygons;  // x0 y0 x1 y1 ..., px
  std::vector<std::uint32_t> runs;

  /// The value of COCO's key "segmentation": a list of polygons, or {"size": [h, w], "counts": list or text}.
  /// @throws std::exception with what is wrong
  static CocoRegion parse(const nlohmann::json& json);

  /// CV_8UC1, 255 = object; pixel for pixel what pycocotools makes of it.
  cv::Mat mask(cv::Size size) const;
};

/// COCO's compressed text of a mask that fills `window` of an image.
/// @param mask CV_8UC1 of the window's size, any value but 0 = object.
std::string pack_region(const cv::Mat& mask, const cv::Rect& window, cv::Size size);

}  // namespace semvslam
