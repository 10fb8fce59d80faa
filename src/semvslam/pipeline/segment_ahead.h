#pragma once

#include <cstddef>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "semvslam/base/bounded_queue.h"
#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/pipeline/slam.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

struct SegmentedFrame {
  RgbdFrame frame;
  bool has_segmentation = false;  // it was asked for; `segmentation` may still be absent: see SegmentationStage
  std::optional<Segmentation> segmentation;
};

/// Reads a recording and segments its frames in threads of its own, while the frames before are tracked: each frame
/// comes with its own mask, in the source's order. At most `capacity` frames wait beside those being segmented; the
/// threads BLOCK when they are not fetched. They give way to all other threads, where the system lets them: masks are
/// made in what time tracking and mapping leave. Destruction at any time stops after the frames that are being
/// segmented.
class SegmentAhead {
 public:
  using Segment = std::function<std::optional<Segmentation>(const RgbdFrame&)>;

  /// @param source must outlive this object and is used by its threads only, by one at a time.
  /// @param segment called on those threads, by as many at once as there are; empty = frames come without
  /// segmentation, on the calling thread.
  /// @param at_once so many frames are segmented at the same time, at least one.
  SegmentAhead(FrameSource& source, Segment segment, std::size_t at_once, std::size_t capacity);
  ~SegmentAhead();

  /// As FrameSource::next. One thread.
  Result<std::optional<SegmentedFrame>> next();
  bool fatal() const { return fatal_; }

 private:
  struct Item {
    Result<std::optional<SegmentedFrame>> result;
    bool fatal = false;
    bool is_last() const { return fatal || (result && !result->has_value()); }
  };
  Item read();
  void work();

  FrameSource& source_;
  const Segment segment_;
  std::mutex reading_;  // of source_ and ended_; held until the frame has its place in the order
  bool ended_ = false;
  BoundedQueue<std::future<Item>> items_;
  bool fatal_ = false;
  std::vector<std::jthread> threads_;
};

/// Every frame of a recording gets its own mask, made while the frames before are tracked. Where the order of all steps
/// is fixed, or no mask may be waited for, there is none to make ahead (empty): the system segments by itself.
SegmentAhead::Segment segment_ahead_of(Slam& slam);

}  // namespace semvslam
