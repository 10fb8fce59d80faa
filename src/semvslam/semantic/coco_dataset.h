#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// One labelled object. Its region is kept as drawn and made into pixels when asked for.
struct CocoObject {
  int category = 0;    // COCO's id
  bool crowd = false;  // neither object nor background
  cv::Rect2d box;
  std::vector<std::vector<double>> polygons;  // x0 y0 x1 y1 ...
  std::vector<std::uint32_t> runs;  // run lengths, column by column, where the region is not drawn as polygons

  /// CV_8UC1, 255 = object; pixel for pixel what pycocotools makes of it.
  cv::Mat mask(cv::Size size) const;
};

struct CocoImage {
  std::string file;  // relative to the folder of images
  cv::Size size;
  std::vector<CocoObject> objects;
};

/// Annotated images in the format of the COCO data set.
struct CocoDataset {
  std::vector<CocoImage> images;
  std::map<int, std::string> categories;

  /// Errors: missing, no JSON, a key missing or of a wrong type, an annotation of an unknown image.
  static Result<CocoDataset> read(const std::filesystem::path& json);
};

}  // namespace semvslam
