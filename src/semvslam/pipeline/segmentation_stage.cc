#include "semvslam/pipeline/segmentation_stage.h"

namespace semvslam {

Result<std::unique_ptr<SegmentationStage>> SegmentationStage::create(const Config& config) {
  std::unique_ptr<SegmentationStage> stage(new SegmentationStage(config));
  SegmenterOptions options = config.segment;
  // The fast number type differs from machine to machine; equal bytes need the same one everywhere.
  if (config.deterministic) options.precision = "f32";
  Result<std::unique_ptr<Segmenter>> segmenter = make_segmenter(options, RoleTable(), &stage->timers_);
  if (!segmenter) return segmenter.error();
  stage->segmenter_ = std::move(*segmenter);
  return stage;
}

SegmentationStage::~SegmentationStage() { frames_.close(); }

std::optional<Segmentation> SegmentationStage::segment(const RgbdFrame& frame) {
  if (!status()) return std::nullopt;
  SegmentationRequest request;
  request.frame = frame.id;
  request.stamp = frame.stamp;
  request.image = frame.colour.empty() ? frame.gray : frame.colour;
  Result<Segmentation> result = [&] {
    const auto timing = timers_["segment"].time();
    return segmenter_->segment(request);
  }();
  if (!result) {
    std::lock_guard lock(mutex_);
    failure_ = result.error();
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
