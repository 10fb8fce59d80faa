#include "semvslam/dynamic/dynamic_record.h"

#include <algorithm>

#include "semvslam/geometry/mask_lookup.h"

namespace semvslam {

std::string_view to_string(FeatureVerdict verdict) {
  switch (verdict) {
    case FeatureVerdict::kStatic:
      return "static";
    case FeatureVerdict::kMoving:
      return "moving";
    case FeatureVerdict::kUnknown:
      break;
  }
  return "unknown";
}

std::string_view to_string(FeatureReason reason) {
  switch (reason) {
    case FeatureReason::kNone:
      return "none";
    case FeatureReason::kNoEvidence:
      return "no_evidence";
    case FeatureReason::kNearMoving:
      return "near_moving";
    case FeatureReason::kAtOutline:
      return "at_outline";
    case FeatureReason::kPointMotion:
      return "point_motion";
    case FeatureReason::kMovingRegion:
      return "moving_region";
    case FeatureReason::kMovingInstance:
      break;
  }
  return "moving_instance";
}

std::string_view to_string(MaskSource source) {
  switch (source) {
    case MaskSource::kNone:
      return "none";
    case MaskSource::kGiven:
      return "given";
    case MaskSource::kSegmented:
      return "segmented";
    case MaskSource::kPropagated:
      break;
  }
  return "propagated";
}

std::string_view to_string(FailOpen fail_open) {
  switch (fail_open) {
    case FailOpen::kNo:
      return "no";
    case FailOpen::kMotion:
      return "motion";
    case FailOpen::kSemantic:
      break;
  }
  return "semantic";
}

bool DynamicRecord::is_left_out(const cv::Point2f& pixel) const {
  return std::any_of(left_out.begin(), left_out.end(), [&](const cv::Mat& mask) { return is_masked(mask, pixel); });
}

}  // namespace semvslam
