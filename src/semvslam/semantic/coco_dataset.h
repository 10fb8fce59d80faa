#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/semantic/coco_region.h"

namespace semvslam {

/// One labelled object.
struct CocoObject {
  int category = 0;    // COCO's id
  bool crowd = false;  // neither object nor background
  cv::Rect2d box;
  CocoRegion region;
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

  /// Errors: no JSON, a key missing or of a wrong type, an annotation of an unknown image. @param origin for messages.
  static Result<CocoDataset> parse(const std::string& text, const std::string& origin);
  /// Errors: missing, and as parse().
  static Result<CocoDataset> read(const std::filesystem::path& json);
};

}  // namespace semvslam
