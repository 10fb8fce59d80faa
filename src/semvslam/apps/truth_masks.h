#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/pipeline/slam.h"

namespace semvslam {

/// How well features on moving things were told from those on the static scene.
struct TruthCounts {
  std::uint64_t frames = 0;                         // with a true mask
  std::uint64_t kept = 0, kept_on_moving = 0;       // features that tracking used
  std::uint64_t on_static = 0, static_dropped = 0;  // features of the whole image on the static scene; not used of them

  double kept_on_moving_share() const { return kept == 0 ? 0 : static_cast<double>(kept_on_moving) / kept; }
  double static_dropped_share() const { return on_static == 0 ? 0 : static_cast<double>(static_dropped) / on_static; }
};

/// Compares what the policy left out with true masks. Extracts the features of every whole image once more to know what
/// lies under the masks: for measurements only, it costs time.
class TruthMaskSink : public Sink {
 public:
  /// @param folder one PNG per frame, non-zero = something that moves; frames without one are not counted. Errors: no
  /// such folder, no mask in it.
  static Result<std::shared_ptr<TruthMaskSink>> open(const std::filesystem::path& folder, const OrbOptions& orb);
  virtual const TruthCounts& counts() const = 0;
};

}  // namespace semvslam
