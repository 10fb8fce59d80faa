#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "semvslam/base/bounded_queue.h"
#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

struct SegmentedFrame {
  RgbdFrame frame;
  bool has_segmentation = false;  // it was asked for; `segmentation` may still be absent: see SegmentationStage
  std::optional<Segmentation> segmentation;
};

/// Reads a recording and segments every frame in a thread of its own, while the frames before are tracked: each frame
/// comes with its own mask. At most `capacity` frames ahead; the reading thread BLOCKS when they are not fetched.
/// Destruction at any time stops after the frame that is being segmented.
class SegmentAhead {
 public:
  using Segment = std::function<std::optional<Segmentation>(const RgbdFrame&)>;

  /// @param source must outlive this object and is used by its thread only.
  /// @param segment called on that thread; empty = frames come without segmentation, on the calling thread.
  SegmentAhead(FrameSource& source, Segment segment, std::size_t capacity);
  ~SegmentAhead();

  /// As FrameSource::next. One thread.
  Result<std::optional<SegmentedFrame>> next();
  bool fatal() const { return fatal_; }

 private:
  struct Item {
    Result<std::optional<SegmentedFrame>> result;
    bool fatal = false;
  };
  Item read();

  FrameSource& source_;
  const Segment segment_;
  BoundedQueue<Item> items_;
  bool fatal_ = false;
  std::jthread thread_;
};

}  // namespace semvslam
