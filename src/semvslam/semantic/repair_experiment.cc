#include "semvslam/semantic/repair_experiment.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "semvslam/base/ranked.h"

namespace semvslam {

void PixelScore::add(const cv::Mat& found_mask, const cv::Mat& truth_mask) {
  both += cv::countNonZero(found_mask & (truth_mask != 0));
  truth += cv::countNonZero(truth_mask);
  found += cv::countNonZero(found_mask);
}

RepairExperiment::RepairExperiment(const Camera& camera, std::vector<RepairCase> cases) : cases_(std::move(cases)) {
  for (const RepairCase& c : cases_)
    runs_.push_back(std::unique_ptr<Run>(new Run{MaskDamage(c.damage), SegmentationRepair(camera, c.repair), {}}));
}

void RepairExperiment::add(const RgbdFrame& frame, const Segmentation& given, const cv::Mat& truth,
                           const std::optional<SE3>& cur_from_prev) {
  const int given_px = given.pixels_of_class("person");
  for (const std::unique_ptr<Run>& run : runs_) {
    const std::optional<Segmentation> left = run->damage.apply(given);
    const bool damaged = !left || left->pixels_of_class("person") != given_px;
    RepairInput input{frame.id, frame.stamp, frame.gray, frame.depth, left ? &*left : nullptr, cur_from_prev};
    const RepairedSegmentation repaired = [&] {
      const auto lap = run->time.time();
      if (!damaged) return run->repair.process(input);
      const auto damaged_lap = run->damaged_time.time();
      return run->repair.process(input);
    }();
    const cv::Mat found = repaired.segmentation.mask_of_class("person");
    RepairCaseScore& score = run->score;
    const bool lack = repaired.record.quality.state != SegmentationState::kQualified;
    score.all.add(found, truth);
    ++score.frames;
    score.restored_instances += repaired.record.restored_instances;
    score.extended_instances += repaired.record.extended_instances;
    if (damaged) {
      score.damaged.add(found, truth);
      ++score.damaged_frames;
      score.detected_frames += lack;
    } else {
      score.false_alarms += lack;
    }
  }
}

std::vector<RepairCaseScore> RepairExperiment::scores() const {
  std::vector<RepairCaseScore> out;
  for (const std::unique_ptr<Run>& run : runs_) {
    out.push_back(run->score);
    out.back().time = run->time.summary();
    out.back().damaged_time = run->damaged_time.summary();
  }
  return out;
}

void ChangeStatistics::add(FrameId frame, int person_px) {
  changes_.resize(static_cast<std::size_t>(options_.history));
  const double reference = detector_.reference_px();
  for (int gap = 1; gap <= options_.history && static_cast<std::size_t>(gap) <= counts_.size(); ++gap)
    changes_[gap_index(gap)].push_back((person_px - counts_[counts_.size() - static_cast<std::size_t>(gap)]) /
                                       reference);
  counts_.push_back(person_px);
  detector_.step(frame, person_px);
}

double ChangeStatistics::quantile(int gap, double quantile, bool losses_only) const {
  std::vector<double> values;
  if (gap_index(gap) < changes_.size())
    for (const double c : changes_[gap_index(gap)])
      if (!losses_only || c < 0) values.push_back(std::abs(c));
  if (values.empty()) return -1;
  return ranked(std::span(values), static_cast<std::size_t>(quantile * static_cast<double>(values.size() - 1)));
}

}  // namespace semvslam
