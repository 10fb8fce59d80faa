#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/semantic/mask_carry.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

struct InstanceMemoryOptions {
  double least_overlap = 0.2;  // IoU of a tracked and a segmented instance of one class that are the same object
  int confirmations = 2;       // frames in which an object was segmented before it may be restored
  int longest_carry = 15;      // frames in a row that an object is carried without being segmented
  int least_px = 200;          // smaller remains are dropped
  double limb_trigger = 0.04;  // loss of area, as a share, at which lost parts are looked for
  double least_limb = 0.02;    // smallest lost part, as a share of the object's area

  void add_to(ConfigSchema& schema);
};

/// What InstanceMemory did to one frame.
struct MemoryReport {
  int restored_instances = 0, extended_instances = 0, restored_px = 0;
};

/// Follows every dynamic instance over the frames: by overlap, class and depth. One that vanishes in mid-image is
/// restored, one that leaves through the border or goes behind something nearer is not; parts that vanish while their
/// depth stays are put back.
class InstanceMemory {
 public:
  InstanceMemory(const Camera& camera, const MaskCarryOptions& carry, const InstanceMemoryOptions& options);

  /// Updates the memory and repairs `segmentation` (of the frame `present`, its size the camera's) in place.
  /// @param lacking whether the segmentation as a whole is known to lack something: then every instance is looked at.
  MemoryReport step(const CarryFrame& present, const std::optional<SE3>& cur_from_prev, bool lacking,
                    Segmentation& segmentation);
  void reset();

 private:
  struct Track {
    TrackId id;
    Instance last;   // in the frame before
    Instance whole;  // as last segmented without loss: what is carried, so that errors do not add up
    CarryFrame whole_images;
    int whole_px = 0;
    int whole_age = 0;                      // frames
    float depth_m = 0;                      // median; 0 = unknown
    std::optional<SE3> present_from_whole;  // camera motion since then; none = unknown
    bool velocity_known = false;            // the last one was measured by flow
    cv::Point2f shift_px, velocity_px;      // motion since then, motion per frame
    int confirmed = 0;                      // frames in which it was segmented
    int carried = 0;                        // frames in a row without
    Instance known;                         // as last seen unhidden: what it is recognised by
    cv::Point2f known_shift_px;             // motion since then
    int known_age = 0;                      // frames
    bool half_hidden = false;               // segmented, but partly behind something nearer
    bool hidden = false;                    // behind something nearer; may come out again
    int extended = 0;                       // frames in a row with a part put back
  };
  struct Step;  // what belongs to one call of step()
  void match(Step& step);
  void follow(Step& step, Track& track, std::size_t index);
  bool extend(Step& step, Track& track, Instance& now);
  CarriedMask carry_whole(const Step& step, Track& track) const;
  static void renew(const Step& step, Track& track, const Instance& now, int pixels);
  bool restore(Step& step, Track& track);

  MaskCarry carry_;
  InstanceMemoryOptions options_;
  std::vector<Track> tracks_;
  std::uint32_t next_track_ = 0;
};

}  // namespace semvslam
