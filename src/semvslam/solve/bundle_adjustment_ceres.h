#pragma once

#include <cstdint>
#include <vector>

#include "semvslam/solve/bundle_adjustment.h"

namespace semvslam {

/// adjust_bundle() by the Ceres library: the same residuals, losses, passes and outlier rule, with Ceres' trust region
/// and DENSE_SCHUR on one thread. The reference for tests and the comparison in the benchmark; nothing else links it.
BaSummary adjust_bundle_ceres(BaProblem& problem, const BaOptions& options, std::vector<std::uint8_t>& edge_inlier);

}  // namespace semvslam
