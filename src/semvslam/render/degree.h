#pragma once

#include <cmath>

namespace semvslam::render {

inline constexpr double kDegree = M_PI / 180;  // radians

}  // namespace semvslam::render
