#pragma once

#include <string>
#include <vector>

#include "semvslam/web/viewed_run.h"

namespace semvslam {

/// The numbers of the runs and what is missing, as HTML. Everything that comes from files is escaped.
std::string format_panel(const std::vector<ViewedRun>& runs);

}  // namespace semvslam
