#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/pipeline/slam.h"

namespace semvslam {

/// How well features on moving things were told from those on the static scene.
struct TruthCounts {
  struct Share {
    std::uint64_t all = 0, part = 0;
    void count(bool is_part) { ++all, part += is_part; }
    double value() const { return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all); }
  };
  std::uint64_t frames = 0;  // with a true mask
  Share kept_on_moving;      // of the features that are used: a landmark may come from them or was found at them
  Share tracked_on_moving;   // of those that a landmark was found at: the ones that the pose comes from
  Share static_dropped;      // of the whole image's features on the static scene, those that tracking may not use
  /// The same of those whose surroundings are static too: a descriptor at an outline sees both sides.
  Share clear_static_dropped;
  /// Of the features on the static scene that are not dropped: those that no landmark was found at and may come from.
  Share static_barred;
  /// Per frame: of the moving things' pixels those that the policy masked, and of those that it masked the moving ones.
  /// The outline is the policy's own, before it is widened for features. Frames without either are not listed.
  std::vector<double> pixel_recalls, pixel_precisions;
};

/// Compares what the policy left out with true masks. Extracts the features of every whole image once more to know what
/// lies under the masks: for measurements only, it costs time.
class TruthMaskSink : public Sink {
 public:
  /// @param folder one PNG per frame, non-zero = something that moves; frames without one are not counted.
  /// @param outline_px how far from anything that moves a feature's surroundings count as static. Errors: no such
  /// folder, no mask in it.
  static Result<std::shared_ptr<TruthMaskSink>> open(const std::filesystem::path& folder, const OrbOptions& orb,
                                                     int outline_px);
  virtual const TruthCounts& counts() const = 0;
};

}  // namespace semvslam
