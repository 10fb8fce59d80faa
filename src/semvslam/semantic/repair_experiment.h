#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/base/stage_timer.h"
#include "semvslam/data/frame.h"
#include "semvslam/semantic/mask_damage.h"
#include "semvslam/semantic/segmentation_repair.h"

namespace semvslam {

/// Person pixels found against true ones.
struct PixelScore {
  std::int64_t both = 0, truth = 0, found = 0;

  void add(const cv::Mat& found_mask, const cv::Mat& truth_mask);
  /// -1 where there is nothing to measure.
  double recall() const { return truth > 0 ? static_cast<double>(both) / static_cast<double>(truth) : -1; }
  double precision() const { return found > 0 ? static_cast<double>(both) / static_cast<double>(found) : -1; }
};

/// One way to damage and repair all segmentations of a recording.
struct RepairCase {
  MaskDamageOptions damage;
  RepairOptions repair;
};

struct RepairCaseScore {
  PixelScore all;      // of every frame
  PixelScore damaged;  // of the frames that lost something
  int frames = 0, damaged_frames = 0;
  int detected_frames = 0;  // of the damaged ones: the paper's rule saw a lack
  int false_alarms = 0;     // of the others
  int restored_instances = 0, extended_instances = 0;
  StageSummary time;          // of SegmentationRepair::process, all frames
  StageSummary damaged_time;  // the same, frames that lost something
};

/// Runs many cases over one recording, frame by frame.
class RepairExperiment {
 public:
  RepairExperiment(const Camera& camera, std::vector<RepairCase> cases);

  /// @param given undamaged segmentation of the frame. @param truth CV_8UC1, non-zero = person.
  /// @param cur_from_prev camera motion since the frame added before, where it is known.
  void add(const RgbdFrame& frame, const Segmentation& given, const cv::Mat& truth,
           const std::optional<SE3>& cur_from_prev);
  const std::vector<RepairCase>& cases() const { return cases_; }
  std::vector<RepairCaseScore> scores() const;

 private:
  struct Run {
    MaskDamage damage;
    SegmentationRepair repair;
    RepairCaseScore score;
    StageTimer time{"repair"}, damaged_time{"repair.damaged"};
  };
  std::vector<RepairCase> cases_;
  std::vector<std::unique_ptr<Run>> runs_;
};

/// How much the number of person pixels changes between good segmentations: what alpha, beta and gamma are chosen from.
class ChangeStatistics {
 public:
  explicit ChangeStatistics(const MissingSegmentationOptions& options) : options_(options), detector_(options) {}

  void add(FrameId frame, int person_px);
  /// The share `quantile` of all |delta| / ref over a gap of k frames is smaller; -1 without any.
  /// @param losses_only count only delta < 0.
  double quantile(int gap, double quantile, bool losses_only) const;
  std::size_t count(int gap) const { return gap_index(gap) < changes_.size() ? changes_[gap_index(gap)].size() : 0; }

 private:
  static std::size_t gap_index(int gap) { return static_cast<std::size_t>(gap - 1); }
  MissingSegmentationOptions options_;
  MissingSegmentationDetector detector_;
  std::vector<int> counts_;
  std::vector<std::vector<double>> changes_;  // signed, per gap
};

}  // namespace semvslam
