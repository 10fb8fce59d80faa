#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <vector>

#include "semvslam/motion/moving_regions.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

/// Whether two windows are those of one thing, a frame apart: their intersection over union is above 0.3.
bool is_same_place(const cv::Rect& a, const cv::Rect& b);

/// Remembers of every instance of a dynamic class since when none of it has been seen to move: a person who sits or
/// sleeps may be part of the static scene until she moves. Without evidence (too few points in her) she does not rest.
class InstanceRest {
 public:
  /// @param rest_after_s how long nothing of an instance may have moved; 0 = none ever rests.
  explicit InstanceRest(double rest_after_s) : rest_after_s_(rest_after_s) {}

  /// Whether an instance of the present frame has rested for long, up to the last update.
  bool rests(const Instance& instance) const;
  /// Whether points should be followed in it to learn more: not just after it was seen to move.
  bool is_worth_watching(const Instance& instance, double time_s) const;

  /// @param motions of the points in each instance, as many.
  void update(std::span<const Instance> instances, std::span<const InstanceMotion> motions, double time_s);

 private:
  struct Entry {
    TrackId track;  // where the segmentation follows its instances
    std::string class_name;
    cv::Rect window;
    double seen_at_s = 0, moved_at_s = 0, still_since_s = 0;
  };
  const Entry* find(const Instance& instance) const;

  double rest_after_s_;
  double time_s_ = 0;  // of the last update
  std::vector<Entry> entries_;
};

}  // namespace semvslam
