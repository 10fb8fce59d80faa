#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/eval/association.h"
#include "semvslam/eval/statistics.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// Absolute trajectory error: how far the estimated positions lie from the true ones after the whole estimate was moved
/// onto the truth by the best rigid motion (or similarity). J. Sturm et al., A benchmark for the evaluation of RGB-D
/// SLAM systems, IROS 2012, with the alignment of Umeyama 1991.
struct AbsoluteError {
  Sim3 reference_from_estimate;            // scale 1 unless it was asked for
  std::vector<TimeStamp> stamps;           // of the estimate, one per pair
  std::vector<Eigen::Vector3d> reference;  // paired true positions, m
  std::vector<Eigen::Vector3d> estimate;   // paired estimated positions after alignment, m
  std::vector<double> errors_m;
  ErrorStatistics statistics_m;
};

/// Errors: fewer than 3 pairs, or positions on one line (no unique alignment).
Result<AbsoluteError> absolute_error(const Trajectory& reference, const Trajectory& estimate,
                                     const std::vector<PosePair>& pairs, bool with_scale);
/// The same where the two worlds are known to lie like this to each other: what the best alignment would take away of
/// the error stays in it.
AbsoluteError absolute_error(const Trajectory& reference, const Trajectory& estimate,
                             const std::vector<PosePair>& pairs, const Sim3& reference_from_estimate);

/// The step over which a relative error is taken.
struct Delta {
  enum class Unit { kSeconds, kFrames };
  double amount = 1;
  Unit unit = Unit::kSeconds;

  /// "1s", "0.5s", "1f", "30f". Errors: anything else, zero, negative, fractions of frames.
  static Result<Delta> parse(std::string_view text);
  std::string text() const;
};

/// Relative pose error, the drift over a fixed step: E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j) with the truth Q and the estimate
/// P (Sturm 2012, as `evo`); of each E the length of the translation (m) and the angle of the rotation (deg).
struct RelativeError {
  struct Step {
    std::size_t from = 0, to = 0;  // indices into the list of pairs
  };
  std::vector<Step> steps;
  std::vector<double> translation_errors_m, rotation_errors_deg;
  ErrorStatistics translation_m, rotation_deg;
};

struct RelativeErrorOptions {
  Delta delta;
  /// true: a step starts at every pair and steps overlap (TUM's tool; `evo_rpe --all_pairs`). false: the next step
  /// starts where the last one ended (`evo_rpe` without that flag). The same for a delta of one frame.
  bool overlapping = true;
  double scale = 1;  // of the estimate's translations
};

/// Steps count paired poses (frames), or look for the pair whose stamp is nearest to start + delta (seconds) and at
/// most a twentieth of delta away from it, so that no step spans a stretch where tracking was lost. Errors: no two
/// pairs are one delta apart.
Result<RelativeError> relative_error(const Trajectory& reference, const Trajectory& estimate,
                                     const std::vector<PosePair>& pairs, const RelativeErrorOptions& options);

}  // namespace semvslam
