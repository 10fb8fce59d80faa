#pragma once

#include "semvslam/data/frame.h"

namespace semvslam {

/// A Trajectory with a type of its own, as Python has it.
struct PoseList {
  Trajectory poses;
};

}  // namespace semvslam
