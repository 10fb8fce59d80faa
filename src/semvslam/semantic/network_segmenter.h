#pragma once

#include <memory>

#include "semvslam/base/side_task.h"
#include "semvslam/semantic/mask_paste.h"
#include "semvslam/semantic/network_graphs.h"
#include "semvslam/semantic/segmenter.h"

namespace semvslam {

/// Mask R-CNN: the graphs run in an inference library; anchors, proposals, regions and pasting are here
/// (training/README.md, "After the graphs").
class NetworkSegmenter final : public Segmenter {
 public:
  struct Limits {
    int proposals_per_level = 300;
    float proposal_overlap = 0.7f;  // IoU above which the weaker of two proposals goes
    float object_overlap = 0.5f;    // the same of objects of one class
    int objects = 50;
    float score = static_cast<float>(kLeastScore);
  };

  /// @param timers may be null; gets segment.prepare, .trunk, .proposals, .boxes, .masks. Must outlive this object.
  NetworkSegmenter(std::unique_ptr<NetworkGraphs> graphs, ModelDescription model, Limits limits, RoleTable roles,
                   StageTimers* timers);

  Result<Segmentation> segment(const SegmentationRequest& request) override;
  const std::vector<std::string>& class_names() const override { return model_.classes; }
  double gflops() const override { return model_.gflops.of_image(kCostProposals, kCostMasks); }
  std::string description() const override { return graphs_->description(); }

 private:
  struct Object {
    DetectionBox box;  // px of the network's input
    int class_index = 0;
    float score = 0;
  };
  struct RefinedMask {
    MaskGrid grid;
    float certainty = 0;  // mean probability of the cells inside
  };
  Result<std::vector<DetectionBox>> propose(const TrunkOutput& trunk) const;
  Result<std::vector<Object>> classify(const TrunkOutput& trunk, const std::vector<DetectionBox>& proposals);
  SemanticHint semantic_hint(const TrunkOutput& trunk, float scale_x, float scale_y) const;
  Result<PastedMask> paste(MaskGraphs& graphs, const TrunkOutput& trunk, const Object& object, float scale_x,
                           float scale_y, cv::Size image) const;
  /// The masks of all objects, by as many threads as there are mask graphs; in the order of the objects.
  Result<std::vector<PastedMask>> paste_all(const TrunkOutput& trunk, const std::vector<Object>& objects, float scale_x,
                                            float scale_y, cv::Size image);
  /// Sharpens a mask of the network's input with the trunk's fine features; what is returned is inside where >= 0.5.
  /// @param score the box head's; certainty is 0 and nothing is refined where the two would fall short of the least.
  Result<RefinedMask> refine(MaskGraphs& graphs, const TrunkOutput& trunk, const MaskGrid& mask, float score,
                             float threshold, const SemanticHint* hint) const;
  Status draw(const TrunkOutput& trunk, const std::vector<Object>& objects, float scale_x, float scale_y,
              Segmentation& out);
  void align_region(const TrunkOutput& trunk, const DetectionBox& box, std::span<const float> levels, int cells,
                    float* to) const;

  std::unique_ptr<NetworkGraphs> graphs_;
  const ModelDescription model_;
  const Limits limits_;
  const RoleTable roles_;
  StageTimers own_timers_;
  StageTimers& timers_;
  std::array<std::vector<DetectionBox>, ModelDescription::kLevels> anchors_;
  cv::Mat input_;
  std::vector<std::unique_ptr<SideTask>> beside_;  // one for each mask graph but the first
};

}  // namespace semvslam
