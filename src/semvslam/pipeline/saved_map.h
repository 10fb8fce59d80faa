#pragma once

#include "semvslam/base/result.h"
#include "semvslam/map/map.h"

namespace semvslam {

/// Whether a session can begin in a saved map. @param model of the session. Errors (kInvalidInput): no key frames;
/// another camera, whose pixels are more than one off; other pyramid levels.
Status check_saved_map(const Map& map, const ObservationModel& model);

}  // namespace semvslam
