#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

/// Any image file that OpenCV reads, CV_8UC3 BGR. Errors: missing, empty, damaged.
Result<cv::Mat> read_picture(const std::filesystem::path& file);

/// The image with every instance tinted, framed and named.
cv::Mat draw_overlay(const cv::Mat& bgr, const Segmentation& segmentation);

/// Errors: not writable.
Status write_picture(const std::filesystem::path& file, const cv::Mat& image);

/// {"width", "height", "instances": [{"class", "role", "score", "box": [x0, y0, x1, y1], "pixels",
/// "segmentation": {"size", "counts"}}]}, the last as COCO's compressed run lengths; a folder of these is a source of
/// masks
std::string to_json(const Segmentation& segmentation);

/// Writes `stem`.overlay.png, `stem`.instances.png (16 bit: 0 = none, n = n-th instance) and `stem`.json into a folder.
Status write_segmentation(const std::filesystem::path& folder, const std::string& stem, const cv::Mat& bgr,
                          const Segmentation& segmentation);

}  // namespace semvslam
