#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "semvslam/base/config_schema.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

struct MaskDamageOptions {
  std::string kind = "none";  // none, frames (whole segmentations), instances, limbs (parts of instances)
  double share = 0.3;         // of frames or instances that are damaged
  int run = 1;                // so many frames in a row share their fate
  int seed = 1;
  double smallest_cut = 0.1, largest_cut = 0.35;  // share of an instance's pixels that a lost limb takes

  void add_to(ConfigSchema& schema);  // semantic.damage_*
};

/// Damages good segmentations, to measure what repair is worth. What happens to a frame depends on the seed and on its
/// FrameId only, not on what was asked before: threaded and deterministic runs see the same damage.
class MaskDamage {
 public:
  explicit MaskDamage(const MaskDamageOptions& options);

  /// Persons only; other classes stay. @return none where the whole segmentation is dropped.
  std::optional<Segmentation> apply(const Segmentation& whole) const;

 private:
  MaskDamageOptions options_;
};

}  // namespace semvslam
