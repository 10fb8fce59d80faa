#pragma once

#include <string>

#include "semvslam/base/config_schema.h"
#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/frame_features.h"
#include "semvslam/mapping/mapper.h"
#include "semvslam/tracking/tracker.h"

namespace semvslam {

/// Every value that changes what the system does. Defaults are the documented preset `orb`.
struct Config {
  std::string mode = "orb";    // preset: which evidence of motion is used
  bool deterministic = false;  // run the same steps in a fixed order on the calling thread
  bool realtime = false;       // never wait: a key frame that mapping cannot take now is asked for again later
  int mapping_queue = 2;       // key frames that may wait for mapping
  OrbOptions orb;
  NoiseModel noise;
  TrackingOptions tracking;
  MappingOptions mapping;

  /// The description of every value, bound to the fields of this object (which must outlive it and not move).
  ConfigSchema schema();
};

}  // namespace semvslam
