#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/feature/features.h"

namespace semvslam {

struct OrbOptions {
  int features = 1000;         // aimed at per image
  int levels = 8;              // of the pyramid
  double scale_factor = 1.2;   // between levels
  int fast_threshold = 20;     // grey levels
  int fast_threshold_low = 5;  // in cells where the first finds nothing, as in blurred images
  int cell_px = 32;            // side of the cells that corners are spread over
  bool subpixel = true;  // move corners to the peak of Harris' score, between the pixels (see corner_refinement.h)
};

/// Scale factor^level for every level of `options`.
std::vector<float> level_scales(const OrbOptions& options);

/// Oriented FAST corners with rotated BRIEF descriptors on an image pyramid, spread evenly over the image.
/// Deterministic: the same image and mask give the same bytes, on any number of cores. Not thread-safe: keeps its
/// buffers between calls (no allocation per frame once warm); use one extractor per thread.
class OrbExtractor {
 public:
  explicit OrbExtractor(const OrbOptions& options);
  ~OrbExtractor();
  OrbExtractor(OrbExtractor&&) noexcept;
  OrbExtractor& operator=(OrbExtractor&&) noexcept;

  /// @param gray CV_8UC1, at least 64x64 (smaller gives no features).
  /// @param mask empty, or CV_8UC1 of the same size: no corner is taken where it is non-zero, so that the budget of
  ///        features goes to the rest of the image.
  /// @param out overwritten.
  void extract(const cv::Mat& gray, const cv::Mat& mask, OrbFeatures& out);

  /// From the next image on so many features are aimed at, instead of OrbOptions::features. Negative: none.
  void set_budget(int features);

  /// The pyramid of the last image: level 0 is the image itself. Valid until the next extract().
  const std::vector<cv::Mat>& pyramid() const;
  const OrbOptions& options() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace semvslam
