#pragma once

#include <string>

#include "semvslam/web/scene.h"

namespace semvslam {

/// A drawing (SVG) for where the page's script or WebGL is missing: the ways seen from above and, where there is a
/// ground truth, the errors over time. Empty without any pose.
std::string draw_plan(const Scene& scene);

/// Colour of the i-th run, here and in the page.
std::string run_colour(std::size_t i);

}  // namespace semvslam
