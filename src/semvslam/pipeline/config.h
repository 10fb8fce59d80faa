#pragma once

#include <string>

#include "semvslam/base/config_schema.h"
#include "semvslam/base/result.h"
#include "semvslam/dense/voxel_map.h"
#include "semvslam/dynamic/dynamic_filter.h"
#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/frame_features.h"
#include "semvslam/mapping/mapper.h"
#include "semvslam/semantic/mask_damage.h"
#include "semvslam/semantic/segmenter.h"
#include "semvslam/tracking/tracker.h"

namespace semvslam {

/// Every value that changes what the system does. Default-constructed it is the mode `orb`, which needs no model.
struct Config {
  std::string mode = "orb";    // the preset that the values began with: which evidence of motion is used
  bool deterministic = false;  // run the same steps in a fixed order on the calling thread
  bool realtime = false;       // never wait, neither for a mask nor for mapping to take a key frame
  int mapping_queue = 2;       // key frames that may wait for mapping
  int segment_at_once = 2;     // frames of a recording whose masks are made at the same time
  OrbOptions orb;
  NoiseModel noise;
  TrackingOptions tracking;
  MappingOptions mapping;
  SegmenterOptions segment;
  DynamicOptions dynamic;
  MaskDamageOptions damage;  // experiments on the restoration of masks
  DenseOptions dense;        // of a map that is made of the key frames after a run

  /// The description of every value, bound to the fields of this object (which must outlive it and not move).
  ConfigSchema schema();
  /// Sets the values of a mode's preset file; the others stay. Errors: an unknown mode.
  Status apply_mode(const std::string& name);
  /// What single values cannot show: options that contradict each other.
  Status check() const;
  bool needs_segmentation() const { return dynamic.needs_segmentation() && segment.source != "none"; }
};

}  // namespace semvslam
