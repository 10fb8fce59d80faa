#include "semvslam/pipeline/segmentation_stage.h"

namespace semvslam {

SegmentationStage::SegmentationStage(const Config& config) : options_(config.segment), damage_(config.damage) {
  // The fast number type differs from machine to machine; equal bytes need the same one everywhere.
  if (config.deterministic) options_.precision = "f32";
}

Result<std::unique_ptr<SegmentationStage>> SegmentationStage::create(const Config& config) {
  std::unique_ptr<SegmentationStage> stage(new SegmentationStage(config));
  Result<std::unique_ptr<Segmenter>> first = stage->borrow();
  if (!first) return first.error();
  stage->give_back(std::move(*first));
  return stage;
}

SegmentationStage::~SegmentationStage() { frames_.close(); }

Result<std::unique_ptr<Segmenter>> SegmentationStage::borrow() {
  {
    std::lock_guard lock(mutex_);
    if (!free_.empty()) {
      std::unique_ptr<Segmenter> segmenter = std::move(free_.back());
      free_.pop_back();
      return segmenter;
    }
  }
  return make_segmenter(options_, RoleTable(), &timers_);
}

void SegmentationStage::give_back(std::unique_ptr<Segmenter> segmenter) {
  std::lock_guard lock(mutex_);
  free_.push_back(std::move(segmenter));
}

void SegmentationStage::fail(Error error) {
  std::lock_guard lock(mutex_);
  if (!failure_) failure_ = std::move(error);
}

std::optional<Segmentation> SegmentationStage::segment(const RgbdFrame& frame) {
  if (!status()) return std::nullopt;
  Result<std::unique_ptr<Segmenter>> segmenter = borrow();
  if (!segmenter) {
    fail(segmenter.error());
    return std::nullopt;
  }
  SegmentationRequest request;
  request.frame = frame.id;
  request.stamp = frame.stamp;
  request.image = frame.colour.empty() ? frame.gray : frame.colour;
  Result<Segmentation> result = [&] {
    const auto timing = timers_["segment"].time();
    return (*segmenter)->segment(request);
  }();
  give_back(std::move(*segmenter));
  if (!result) {
    fail(result.error());
    return std::nullopt;
  }
  return damage_.apply(*result);
}

void SegmentationStage::offer(const RgbdFrame& frame) {
  if (!thread_.joinable()) {
    thread_ = std::jthread([this] {
      while (const std::optional<RgbdFrame> next = frames_.take())
        if (std::optional<Segmentation> result = segment(*next)) finished_.put(std::move(*result));
    });
  }
  frames_.put(frame);
}

std::optional<Segmentation> SegmentationStage::newest() { return finished_.try_take(); }

Status SegmentationStage::status() const {
  std::lock_guard lock(mutex_);
  if (failure_) return *failure_;
  return Status::success();
}

}  // namespace semvslam
