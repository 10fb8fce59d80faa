#include "semvslam/dynamic/dynamic_overlay.h"

#include <fmt/core.h>

#include <opencv2/imgproc.hpp>

namespace semvslam {
namespace {

cv::Scalar colour_of(FeatureVerdict verdict) {
  switch (verdict) {
    case FeatureVerdict::kStatic:
      return {60, 220, 60};
    case FeatureVerdict::kMoving:
      return {40, 40, 255};
    case FeatureVerdict::kUnknown:
      break;
  }
  return {40, 210, 240};
}

std::string caption(const DynamicRecord& record, const std::string& state) {
  std::string text = fmt::format("{} {}: static {} unknown {} moving {}, mask {}", record.frame.value, state,
                                 record.count(FeatureVerdict::kStatic), record.count(FeatureVerdict::kUnknown),
                                 record.count(FeatureVerdict::kMoving), to_string(record.mask_source));
  if (record.mask_age_frames > 0) text += fmt::format(" ({} old)", record.mask_age_frames);
  if (record.repair.restored_instances + record.repair.extended_instances > 0)
    text += fmt::format(", restored {}", record.repair.restored_instances + record.repair.extended_instances);
  if (record.fail_open != FailOpen::kNo) text += fmt::format(", opened: {}", to_string(record.fail_open));
  return text;
}

}  // namespace

cv::Mat draw_dynamic(const RgbdFrame& frame, const DynamicRecord& record, const std::string& state) {
  cv::Mat picture;
  if (frame.colour.empty())
    cv::cvtColor(frame.gray, picture, cv::COLOR_GRAY2BGR);
  else
    picture = frame.colour.clone();
  if (!record.moving.empty()) {
    cv::Mat tinted;
    cv::addWeighted(picture, 0.55, cv::Mat(picture.size(), CV_8UC3, cv::Scalar(60, 60, 255)), 0.45, 0, tinted);
    tinted.copyTo(picture, record.moving);
  }
  for (const FeatureMark& mark : record.features)
    cv::circle(picture, mark.pixel, mark.tracked ? 3 : 2, colour_of(mark.verdict), mark.tracked ? cv::FILLED : 1,
               cv::LINE_AA);
  const cv::Point origin(6, picture.rows - 8);
  for (const auto& [colour, width] : {std::pair(cv::Scalar(0, 0, 0), 3), std::pair(cv::Scalar(255, 255, 255), 1)})
    cv::putText(picture, caption(record, state), origin, cv::FONT_HERSHEY_SIMPLEX, 0.42, colour, width, cv::LINE_AA);
  return picture;
}

}  // namespace semvslam
