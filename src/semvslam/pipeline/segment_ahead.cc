#include "semvslam/pipeline/segment_ahead.h"

#include <stdexcept>

#include "semvslam/base/thread_priority.h"

namespace semvslam {

SegmentAhead::SegmentAhead(FrameSource& source, Segment segment, std::size_t at_once, std::size_t capacity)
    : source_(source), segment_(std::move(segment)), items_(capacity + at_once) {
  if (at_once == 0) throw std::invalid_argument("segment ahead: nobody to segment");
  if (!segment_) return;
  while (threads_.size() < at_once) threads_.emplace_back([this] { work(); });
}

SegmentAhead::~SegmentAhead() { items_.close(); }

SegmentAhead::Item SegmentAhead::read() {
  Result<std::optional<RgbdFrame>> next = source_.next();
  if (!next) return {next.error(), source_.fatal()};
  if (!*next) return {std::optional<SegmentedFrame>(), false};
  return {std::optional<SegmentedFrame>({std::move(**next), segment_ != nullptr, std::nullopt}), false};
}

void SegmentAhead::work() {
  lower_thread_priority();
  while (true) {
    std::unique_lock lock(reading_);
    if (ended_) return;
    Item item = read();
    std::promise<Item> promise;
    ended_ = !items_.push(promise.get_future()) || item.is_last();
    lock.unlock();
    if (item.result && *item.result) (*item.result)->segmentation = segment_((*item.result)->frame);
    promise.set_value(std::move(item));
  }
}

Result<std::optional<SegmentedFrame>> SegmentAhead::next() {
  if (!segment_) {
    Item item = read();
    fatal_ = item.fatal;
    return std::move(item.result);
  }
  std::optional<std::future<Item>> promised = items_.pop();
  if (!promised) return std::optional<SegmentedFrame>();
  Item item = promised->get();
  fatal_ = item.fatal;
  // Nothing comes after the end: later calls must not wait for it.
  if (item.is_last()) items_.close();
  return std::move(item.result);
}

SegmentAhead::Segment segment_ahead_of(Slam& slam) {
  const Config& config = slam.effective_config();
  if (!config.needs_segmentation() || config.deterministic || config.realtime) return {};
  return [&slam](const RgbdFrame& frame) { return slam.segment(frame); };
}

}  // namespace semvslam
