#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "semvslam/base/config_schema.h"
#include "semvslam/base/result.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/semantic/instance_memory.h"
#include "semvslam/semantic/mask_carry.h"
#include "semvslam/semantic/segmentation.h"
#include "semvslam/semantic/segmentation_quality.h"

namespace semvslam {

struct RepairOptions {
  std::string mode = "carry";  // off, paste (the paper's), carry
  MissingSegmentationOptions quality;
  MaskCarryOptions carry;
  InstanceMemoryOptions memory;
  double longest_pause_s = 0.5;  // a longer time between two frames starts anew

  void add_to(ConfigSchema& schema);
  /// Errors: thresholds out of order.
  Status check() const;
};

/// One frame to repair. Images are shared, not copied: nobody may write to them afterwards.
struct RepairInput {
  FrameId frame;
  TimeStamp stamp;
  cv::Mat gray;   // CV_8UC1, size of the camera; empty = no optical flow
  cv::Mat depth;  // as RgbdFrame::depth; empty = no depth check
  /// Of this frame, or of an earlier one (its `frame` says which): then it is carried to this frame, or, where its
  /// images are no longer kept (RepairOptions::memory.longest_carry frames), counts as missing. Null = missing.
  const Segmentation* segmentation = nullptr;
  /// Camera motion since the frame of the call before: x_cur = cur_from_prev * x_prev. None = unknown.
  std::optional<SE3> cur_from_prev;
};

/// What was done to one frame.
struct RepairRecord {
  FrameId frame;
  bool missing = false;         // there was no segmentation for this frame
  int age_frames = 0;           // how many frames the segmentation was late
  SegmentationQuality quality;  // the paper's rule
  int restored_instances = 0;   // whole ones
  int extended_instances = 0;   // lost parts put back
  int restored_px = 0;
  std::string method = "none";  // none, paste, carry
  std::string note;             // why something given was ignored; empty = all well
};

struct RepairedSegmentation {
  Segmentation segmentation;  // of this frame; instances have provenance and track
  RepairRecord record;
};

/// Finds out what a segmentation lacks and puts it back: MissingSegmentationDetector judges the whole image,
/// InstanceMemory every instance, MaskCarry brings the earlier mask into this frame. Feed every frame in order, also
/// those without a segmentation. Input that does not fit (size of the segmentation, depth or gray image; an unordered
/// or late frame) is left out, and the record says so. Not safe for concurrent use.
class SegmentationRepair {
 public:
  /// @param options must pass check().
  SegmentationRepair(const Camera& camera, const RepairOptions& options);
  ~SegmentationRepair();
  SegmentationRepair(SegmentationRepair&&) noexcept;
  SegmentationRepair& operator=(SegmentationRepair&&) noexcept;

  RepairedSegmentation process(const RepairInput& input);
  /// Forgets all earlier frames.
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace semvslam
