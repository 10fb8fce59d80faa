#pragma once

#include <deque>
#include <optional>
#include <string_view>

#include "semvslam/base/config_schema.h"
#include "semvslam/base/ids.h"

namespace semvslam {

enum class SegmentationState {
  kQualified,    // used as it is
  kSlightLack,   // person pixels are missing
  kSeriousLack,  // many are
};

std::string_view to_string(SegmentationState state);

/// The numbers of the rule. alpha_k = alpha + (k - 1) alpha_step, beta_k and gamma_k likewise; k = frames between the
/// two results. How they were chosen: docs/restoration.md.
struct MissingSegmentationOptions {
  int history = 5;  // N: largest k
  double alpha = 2.5, alpha_step = 1.5;
  double beta = 4.5, beta_step = 3.2;
  double gamma = 9.0, gamma_step = 6.4;
  double first_reference = 500;  // ref_0, px
  double least_update = 0.05;    // share of ref below which a change says nothing about the speed of the scene
  int queue = 20;                // L_max

  void add_to(ConfigSchema& schema);
  /// 0 < alpha_k < beta_k < gamma_k for every k.
  Status check() const;
};

/// What the rule found for one frame.
struct SegmentationQuality {
  SegmentationState state = SegmentationState::kQualified;
  int person_px = 0;        // n_d(W_i)
  int gap = 0;              // k; 0 = no qualified result in the last N frames: nothing to compare with
  int delta_px = 0;         // n_d(W_i) - n_d(W_{i-k}); 0 where gap is 0
  double reference_px = 0;  // ref_i, the one that this frame was judged with
  bool reference_updated = false;
};

/// Detection of missing segmentation by the number of person pixels: Sem-VSLAM paper, section 2.5, Figure 5 and
/// equation (5). With n_d(W_i) pixels now and W_{i-k} the nearest earlier qualified result, k <= N,
///   delta_i = n_d(W_i) - n_d(W_{i-k})
///   qualified: delta_i >= -beta_k ref_i; slight lack: -gamma_k ref_i <= delta_i < -beta_k ref_i; serious lack: below.
/// The reference follows qualified changes with 0.05 ref_i <= |delta_i| <= alpha_k ref_i:
///   ref_{i+1} = (L ref_i + |delta_i|) / (L + 1) while the queue holds L < L_max values,
///               (L_max ref_i - q_front + |delta_i|) / L_max when it is full; then |delta_i| enters the queue.
/// A frame without any qualified result in the N frames before it (the first ones; after N bad ones) is qualified.
class MissingSegmentationDetector {
 public:
  explicit MissingSegmentationDetector(const MissingSegmentationOptions& options = {});

  /// Frames must come in order, gaps are allowed; a frame that is not later than the one before it starts a new history
  /// (the reference stays).
  SegmentationQuality step(FrameId frame, int person_px);
  /// For a frame whose segmentation never came: a serious lack that is known without counting. Changes nothing.
  SegmentationQuality missing() const;
  /// Forgets everything.
  void reset();
  double reference_px() const { return reference_px_; }

 private:
  struct Qualified {
    FrameId frame;
    int person_px = 0;
  };
  bool update_reference(double change_px, int gap);

  MissingSegmentationOptions options_;
  std::optional<Qualified> last_qualified_;
  FrameId last_frame_;
  std::deque<double> queue_;
  double reference_px_;
};

}  // namespace semvslam
