#include "semvslam/apps/truth_masks.h"

#include "semvslam/geometry/mask_lookup.h"
#include "semvslam/semantic/folder_segmenter.h"

namespace semvslam {
namespace {

class FolderTruth final : public TruthMaskSink {
 public:
  FolderTruth(std::unique_ptr<Segmenter> masks, const OrbOptions& orb) : masks_(std::move(masks)), extractor_(orb) {}

  void on_frame(const RgbdFrame& frame, const TrackResult& result) override {
    SegmentationRequest request;
    request.frame = frame.id;
    request.stamp = frame.stamp;
    request.image = frame.gray;
    const Result<Segmentation> truth = masks_->segment(request);
    if (!truth) return;
    const cv::Mat moving = truth->mask_of(Role::kStatic);  // whatever its class: all in the folder moves
    ++counts_.frames;
    for (const FeatureMark& mark : result.dynamic->features) {
      if (mark.verdict == FeatureVerdict::kMoving && result.dynamic->fail_open != FailOpen::kMotion) continue;
      ++counts_.kept;
      counts_.kept_on_moving += is_masked(moving, mark.pixel);
    }
    extractor_.extract(frame.gray, cv::Mat(), whole_);
    const cv::Mat& dropped = result.dynamic->moving;
    for (const Keypoint& k : whole_.keypoints) {
      const cv::Point2f pixel(k.x_px, k.y_px);
      if (is_masked(moving, pixel)) continue;
      ++counts_.on_static;
      counts_.static_dropped += is_masked(dropped, pixel);
    }
    // Single points outside every mask and region are dropped too.
    for (const FeatureMark& mark : result.dynamic->features)
      counts_.static_dropped += mark.reason == FeatureReason::kPointMotion && !is_masked(moving, mark.pixel);
  }
  const TruthCounts& counts() const override { return counts_; }

 private:
  std::unique_ptr<Segmenter> masks_;
  OrbExtractor extractor_;
  OrbFeatures whole_;
  TruthCounts counts_;
};

}  // namespace

Result<std::shared_ptr<TruthMaskSink>> TruthMaskSink::open(const std::filesystem::path& folder, const OrbOptions& orb) {
  Result<std::unique_ptr<Segmenter>> masks = FolderSegmenter::open(folder, RoleTable());
  if (!masks) return masks.error();
  return std::shared_ptr<TruthMaskSink>(std::make_shared<FolderTruth>(std::move(*masks), orb));
}

}  // namespace semvslam
