#include "semvslam/pipeline/segment_ahead.h"

namespace semvslam {

SegmentAhead::SegmentAhead(FrameSource& source, Segment segment, std::size_t capacity)
    : source_(source), segment_(std::move(segment)), items_(capacity) {
  if (!segment_) return;
  thread_ = std::jthread([this] {
    bool more = true;
    while (more) {
      Item item = read();
      more = !item.fatal && (!item.result || item.result->has_value());
      more = items_.push(std::move(item)) && more;
    }
  });
}

SegmentAhead::~SegmentAhead() { items_.close(); }

SegmentAhead::Item SegmentAhead::read() {
  Result<std::optional<RgbdFrame>> next = source_.next();
  if (!next) return {next.error(), source_.fatal()};
  if (!*next) return {std::optional<SegmentedFrame>(), false};
  SegmentedFrame frame{std::move(**next), false, std::nullopt};
  if (segment_) {
    frame.has_segmentation = true;
    frame.segmentation = segment_(frame.frame);
  }
  return {std::optional<SegmentedFrame>(std::move(frame)), false};
}

Result<std::optional<SegmentedFrame>> SegmentAhead::next() {
  if (!segment_) {
    Item item = read();
    fatal_ = item.fatal;
    return std::move(item.result);
  }
  std::optional<Item> item = items_.pop();
  if (!item) return std::optional<SegmentedFrame>();
  fatal_ = item->fatal;
  // Nothing comes after the end: later calls must not wait for it.
  if (item->fatal || (item->result && !item->result->has_value())) items_.close();
  return std::move(item->result);
}

}  // namespace semvslam
