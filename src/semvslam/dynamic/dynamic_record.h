#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string_view>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/motion/motion_check.h"
#include "semvslam/semantic/segmentation_repair.h"

namespace semvslam {

enum class FeatureVerdict : std::uint8_t { kStatic, kMoving, kUnknown };

/// What a verdict on a feature rests on.
enum class FeatureReason : std::uint8_t {
  kNone,            // static: nothing speaks against it
  kNoEvidence,      // unknown: no test could be made
  kNearMoving,      // unknown or static: it may be a part of something that moves, which its mask lacks
  kAtOutline,       // unknown or static: on the outline of something that moves, with which it may move
  kPointMotion,     // moving: the point track beside it moves (its reason: DynamicRecord::track_reasons)
  kMovingRegion,    // moving: on a thing of no known class that moves, or did a moment ago
  kMovingInstance,  // moving: on an instance of a movable class, enough of whose points move
};
inline constexpr std::size_t kFeatureReasons = 7;
inline constexpr std::size_t kMotionReasons = static_cast<std::size_t>(MotionReason::kMemory) + 1;
std::string_view to_string(FeatureVerdict verdict);
std::string_view to_string(FeatureReason reason);

/// Where the mask that a frame was tracked with came from.
enum class MaskSource : std::uint8_t {
  kNone,
  kGiven,       // with the frame
  kSegmented,   // the segmentation of this very frame
  kPropagated,  // an earlier segmentation, carried into this frame
};
inline constexpr std::size_t kMaskSources = 4;
std::string_view to_string(MaskSource source);

/// What was given up because too few features would have been left.
enum class FailOpen : std::uint8_t {
  kNo,
  kMotion,    // the verdicts of motion detection
  kSemantic,  // the masks of the instances with the least scores
};
inline constexpr std::size_t kFailOpens = 3;
std::string_view to_string(FailOpen fail_open);

/// What a feature may be used for.
enum FeatureUse : std::uint8_t {
  kNotUsed = 0,
  kFullyUsed = 1,
  kKnownLandmarkOnly = 2,  // it may be moving: no landmark may come from it
};

/// A feature as the policy saw it, for statistics and pictures.
struct FeatureMark {
  cv::Point2f pixel;  // recorded
  FeatureUse use = kFullyUsed;
  FeatureVerdict verdict = FeatureVerdict::kUnknown;
  FeatureReason reason = FeatureReason::kNoEvidence;
  bool tracked = false;  // a landmark was found at it and agrees with the pose
};

/// What the policy decided for one frame, and why.
struct DynamicRecord {
  FrameId frame;
  MaskSource mask_source = MaskSource::kNone;
  int mask_age_frames = 0;  // of the segmentation that the mask comes from
  RepairRecord repair;      // state of the segmentation; empty where there is none
  FailOpen fail_open = FailOpen::kNo;
  std::array<int, 3> verdicts{};                    // features by FeatureVerdict
  std::array<int, kFeatureReasons> reasons{};       // features by FeatureReason
  std::array<int, kMotionReasons> track_reasons{};  // point tracks of motion detection by MotionReason
  int moving_instances = 0;                         // of movable classes
  int moving_regions = 0;                           // moving things of no known class
  double masked_share = 0;                          // of the image's pixels, before features are extracted
  cv::Mat moving;                                   // CV_8UC1, 255 = pixel of something that moves or may; empty = none
  /// Masks like `moving`, together the same without the outlines: the pixels that no feature is used of.
  std::vector<cv::Mat> left_out;
  std::vector<FeatureMark> features;

  bool is_left_out(const cv::Point2f& pixel) const;
  int count(FeatureVerdict v) const { return verdicts[static_cast<std::size_t>(v)]; }
};

}  // namespace semvslam
