#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "semvslam/base/newest_slot.h"
#include "semvslam/base/result.h"
#include "semvslam/base/stage_timer.h"
#include "semvslam/data/frame.h"
#include "semvslam/pipeline/config.h"

namespace semvslam {

/// Masks beside tracking (paper, section 2.1: the semantic thread). Two ways to use one object, never both: segment()
/// where every frame gets its own mask, however long it takes; offer() and newest() for live streams, which never wait.
/// A segmenter that fails is not asked again: the error is kept, there are no masks any more.
class SegmentationStage {
 public:
  /// Errors: see make_segmenter.
  static Result<std::unique_ptr<SegmentationStage>> create(const Config& config);
  ~SegmentationStage();

  /// The objects in this frame; nothing after a failure, or where damage for tests took the whole segmentation away.
  /// Any number of threads: of those that call at the same time each has a segmenter of its own, made when first
  /// needed.
  std::optional<Segmentation> segment(const RgbdFrame& frame);

  /// Gives the newest frame to the stage's own thread, in place of one that it has not begun with.
  void offer(const RgbdFrame& frame);
  /// The newest finished segmentation that was not fetched yet. Does not wait.
  std::optional<Segmentation> newest();

  /// The first failure, if any.
  Status status() const;
  std::vector<StageSummary> times() const { return timers_.summaries(); }

 private:
  explicit SegmentationStage(const Config& config);
  /// One that no other thread uses until it is given back; made where there is none.
  Result<std::unique_ptr<Segmenter>> borrow();
  void give_back(std::unique_ptr<Segmenter> segmenter);
  void fail(Error error);

  SegmenterOptions options_;
  StageTimers timers_;
  MaskDamage damage_;
  mutable std::mutex mutex_;  // of free_ and failure_
  std::vector<std::unique_ptr<Segmenter>> free_;
  std::optional<Error> failure_;
  NewestSlot<RgbdFrame> frames_;       // drops the frame that is waiting
  NewestSlot<Segmentation> finished_;  // drops the mask that nobody fetched
  std::jthread thread_;
};

}  // namespace semvslam
