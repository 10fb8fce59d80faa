#include "semvslam/eval/evaluation.h"

#include <fmt/format.h>

namespace semvslam {
namespace {

std::string span_text(const Trajectory& t) {
  return fmt::format("{:.3f}..{:.3f} s", t.front().stamp.seconds(), t.back().stamp.seconds());
}

std::string poses(const Trajectory& t) { return fmt::format("{} {}", t.size(), t.size() == 1 ? "pose" : "poses"); }

}  // namespace

Result<Evaluation> evaluate(const Trajectory& reference, const Trajectory& estimate, const EvaluationOptions& options) {
  const auto invalid = [](std::string message) { return Error{ErrorCode::kInvalidInput, std::move(message)}; };
  if (reference.size() < 3) return invalid(fmt::format("the ground truth has {}; 3 are needed", poses(reference)));
  if (estimate.size() < 3) return invalid(fmt::format("the estimate has {}; 3 are needed", poses(estimate)));

  Evaluation out;
  out.reference_poses = reference.size();
  out.estimate_poses = estimate.size();
  const std::vector<PosePair> pairs = pair_by_time(reference, estimate, options.max_gap_s);
  if (pairs.empty())
    return invalid(fmt::format("no pose of the estimate ({}) is within {} ms of one of the ground truth ({})",
                               span_text(estimate), options.max_gap_s * 1e3, span_text(reference)));
  out.pairs = pairs.size();
  out.tracked_share =
      share_tracked(options.frames.empty() ? stamps_of(reference) : options.frames, estimate, options.max_gap_s);

  Result<AbsoluteError> absolute = options.reference_from_estimate
                                       ? absolute_error(reference, estimate, pairs, *options.reference_from_estimate)
                                       : absolute_error(reference, estimate, pairs, options.with_scale);
  if (!absolute) return absolute.error();
  out.absolute = std::move(*absolute);
  RelativeErrorOptions relative_options = options.relative;
  relative_options.scale = out.absolute.reference_from_estimate.scale;
  Result<RelativeError> relative = relative_error(reference, estimate, pairs, relative_options);
  if (!relative) return relative.error();
  out.relative = std::move(*relative);
  return out;
}

}  // namespace semvslam
