#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "semvslam/semantic/coco_dataset.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

/// How well segmentations agree with labelled images. -1 where there was nothing to measure.
struct SegmentationScore {
  int images = 0;
  double person_pixel_iou = -1, person_pixel_recall = -1, person_pixel_precision = -1;
  double person_mask_ap = -1, person_mask_ap50 = -1;  // COCO's definition
  double mask_ap = -1, mask_ap50 = -1;                // mean over the classes that occur
  int near_persons = 0;                               // larger than 96 x 96 px
  double near_person_recall = -1, near_person_mean_iou = -1;
};

/// Collects the images of a data set one after the other and keeps what the scores need, not the masks.
class SegmentationScorer {
 public:
  /// @param sure least score of an instance for the pixel and near-person numbers; the others use all instances.
  SegmentationScorer(const CocoDataset& dataset, double sure);

  void add(const CocoImage& image, const Segmentation& found);
  SegmentationScore score() const;

 private:
  static constexpr int kOverlaps = 10;  // IoU 0.50, 0.55 .. 0.95
  struct Detection {
    float score = 0;
    std::array<bool, kOverlaps> matched{}, ignored{};
  };
  struct ClassRecord {
    std::vector<Detection> detections;
    int objects = 0;
  };
  void add_class(const std::string& name, const std::vector<cv::Mat>& truth, const std::vector<bool>& crowd,
                 const std::vector<const Instance*>& found, cv::Size size);
  void add_person_pixels(const std::vector<cv::Mat>& truth, const std::vector<bool>& crowd,
                         const std::vector<const Instance*>& found, cv::Size size);
  static double average_precision(const ClassRecord& record, int overlap);

  std::map<int, std::string> categories_;
  double sure_;
  std::map<std::string, ClassRecord> classes_;
  int images_ = 0, near_ = 0;
  std::int64_t both_ = 0, either_ = 0, truth_pixels_ = 0, found_pixels_ = 0;
  std::vector<double> near_ious_;
};

}  // namespace semvslam
