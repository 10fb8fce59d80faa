#pragma once

#include <string>

#include "semvslam/web/scene.h"

namespace semvslam {

/// One HTML document that needs nothing else: no other file, no request but, live, to the server it came from.
std::string format_page(const Scene& scene);

}  // namespace semvslam
