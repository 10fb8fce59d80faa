#include "semvslam/apps/truth_masks.h"

#include "semvslam/geometry/mask_growth.h"
#include "semvslam/geometry/mask_lookup.h"
#include "semvslam/semantic/folder_segmenter.h"

namespace semvslam {
namespace {

class FolderTruth final : public TruthMaskSink {
 public:
  FolderTruth(std::unique_ptr<FolderSegmenter> masks, const OrbOptions& orb, int outline_px)
      : masks_(std::move(masks)), extractor_(orb), outline_px_(outline_px) {}

  void on_frame(const RgbdFrame& frame, const TrackResult& result) override {
    SegmentationRequest request;
    request.frame = frame.id;
    request.stamp = frame.stamp;
    request.image = frame.gray;
    if (!masks_->has(request)) return;
    const Result<Segmentation> truth = masks_->segment(request);
    if (!truth) return;
    const cv::Mat moving = truth->mask_of(Role::kStatic);  // whatever its class: all in the folder moves
    cv::Mat near_moving = moving.clone();
    grow_mask(near_moving, outline_px_);
    ++counts_.frames;
    compare_pixels(moving, result.dynamic->moving);
    for (const FeatureMark& mark : result.dynamic->features) {
      if (mark.use == kNotUsed || (mark.use == kKnownLandmarkOnly && !mark.tracked)) continue;
      counts_.kept_on_moving.count(is_masked(moving, mark.pixel));
      if (mark.tracked) counts_.tracked_on_moving.count(is_masked(moving, mark.pixel));
    }
    extractor_.extract(frame.gray, cv::Mat(), whole_);
    for (const Keypoint& k : whole_.keypoints) {
      const cv::Point2f pixel(k.x_px, k.y_px);
      if (is_masked(moving, pixel)) continue;
      const bool dropped = result.dynamic->is_left_out(pixel);
      counts_.static_dropped.count(dropped);
      if (!is_masked(near_moving, pixel)) counts_.clear_static_dropped.count(dropped);
    }
    // Single points outside what is left out as a whole are dropped too.
    for (const FeatureMark& mark : result.dynamic->features) {
      if (is_masked(moving, mark.pixel) || result.dynamic->is_left_out(mark.pixel)) continue;
      if (mark.use != kNotUsed) {
        counts_.static_barred.count(mark.use == kKnownLandmarkOnly && !mark.tracked);
        continue;
      }
      ++counts_.static_dropped.part;
      counts_.clear_static_dropped.part += !is_masked(near_moving, mark.pixel);
    }
  }
  const TruthCounts& counts() const override { return counts_; }

 private:
  /// @param widened what the policy masked, its outline moved outwards; empty = nothing.
  void compare_pixels(const cv::Mat& moving, const cv::Mat& widened) {
    cv::Mat masked = cv::Mat::zeros(moving.size(), CV_8UC1);
    if (!widened.empty()) without_rim(widened, outline_px_, masked);
    const int all = cv::countNonZero(moving), found = cv::countNonZero(masked),
              both = cv::countNonZero(moving & masked);
    if (all > 0) counts_.pixel_recalls.push_back(static_cast<double>(both) / all);
    if (found > 0) counts_.pixel_precisions.push_back(static_cast<double>(both) / found);
  }

  std::unique_ptr<FolderSegmenter> masks_;
  OrbExtractor extractor_;
  int outline_px_;
  OrbFeatures whole_;
  TruthCounts counts_;
};

}  // namespace

Result<std::shared_ptr<TruthMaskSink>> TruthMaskSink::open(const std::filesystem::path& folder, const OrbOptions& orb,
                                                           int outline_px) {
  Result<std::unique_ptr<FolderSegmenter>> masks = FolderSegmenter::open(folder, RoleTable());
  if (!masks) return masks.error();
  return std::shared_ptr<TruthMaskSink>(std::make_shared<FolderTruth>(std::move(*masks), orb, outline_px));
}

}  // namespace semvslam
