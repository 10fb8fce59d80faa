#include "semvslam/semantic/segmentation_quality.h"

#include <fmt/core.h>

#include <cmath>

namespace semvslam {

std::string_view to_string(SegmentationState state) {
  switch (state) {
    case SegmentationState::kQualified:
      return "qualified";
    case SegmentationState::kSlightLack:
      return "slight lack";
    case SegmentationState::kSeriousLack:
      break;
  }
  return "serious lack";
}

void MissingSegmentationOptions::add_to(ConfigSchema& schema) {
  const Range factor{0.0, 1e4};
  schema.add("repair.history", &history, {1, 100}, "N: frames back that a segmentation is compared with");
  schema.add("repair.alpha", &alpha, factor, "alpha_1: largest change that updates the reference, times the reference");
  schema.add("repair.alpha_step", &alpha_step, factor, "growth of alpha per further frame between the two results");
  schema.add("repair.beta", &beta, factor, "beta_1: loss of person pixels that is a slight lack, times the reference");
  schema.add("repair.beta_step", &beta_step, factor, "growth of beta per further frame");
  schema.add("repair.gamma", &gamma, factor, "gamma_1: loss that is a serious lack, times the reference");
  schema.add("repair.gamma_step", &gamma_step, factor, "growth of gamma per further frame");
  schema.add("repair.first_reference", &first_reference, {1.0, 1e7}, "reference variation at the start, px");
  schema.add("repair.least_update", &least_update, {0.0, 1.0},
             "smallest change that updates the reference, times the reference");
  schema.add("repair.queue", &queue, {1, 10000}, "L_max: changes that the reference is the mean of");
}

Status MissingSegmentationOptions::check() const {
  for (int k = 1; k <= history; ++k) {
    const double a = alpha + (k - 1) * alpha_step, b = beta + (k - 1) * beta_step, g = gamma + (k - 1) * gamma_step;
    if (a > 0 && a < b && b < g) continue;
    return Error{
        ErrorCode::kInvalidInput,
        fmt::format("repair.alpha/beta/gamma: 0 < alpha_k < beta_k < gamma_k does not hold for k = {}: {}, {}, {}", k,
                    a, b, g)};
  }
  return Status::success();
}

MissingSegmentationDetector::MissingSegmentationDetector(const MissingSegmentationOptions& options)
    : options_(options), reference_px_(options.first_reference) {}

void MissingSegmentationDetector::reset() {
  last_qualified_.reset();
  last_frame_ = FrameId();
  queue_.clear();
  reference_px_ = options_.first_reference;
}

SegmentationQuality MissingSegmentationDetector::step(FrameId frame, int person_px) {
  if (last_frame_.valid() && frame <= last_frame_) last_qualified_.reset();
  last_frame_ = frame;
  SegmentationQuality out;
  out.person_px = person_px;
  out.reference_px = reference_px_;
  if (last_qualified_ && frame.value - last_qualified_->frame.value <= static_cast<std::uint32_t>(options_.history)) {
    out.gap = static_cast<int>(frame.value - last_qualified_->frame.value);
    out.delta_px = person_px - last_qualified_->person_px;
    const double beta = options_.beta + (out.gap - 1) * options_.beta_step;
    const double gamma = options_.gamma + (out.gap - 1) * options_.gamma_step;
    if (out.delta_px < -gamma * reference_px_)
      out.state = SegmentationState::kSeriousLack;
    else if (out.delta_px < -beta * reference_px_)
      out.state = SegmentationState::kSlightLack;
  }
  if (out.state != SegmentationState::kQualified) return out;
  if (out.gap > 0) out.reference_updated = update_reference(std::abs(out.delta_px), out.gap);
  last_qualified_ = Qualified{frame, person_px};
  return out;
}

SegmentationQuality MissingSegmentationDetector::missing() const {
  SegmentationQuality out;
  out.state = SegmentationState::kSeriousLack;
  out.reference_px = reference_px_;
  return out;
}

bool MissingSegmentationDetector::update_reference(double change_px, int gap) {
  const double alpha = options_.alpha + (gap - 1) * options_.alpha_step;
  if (change_px < options_.least_update * reference_px_ || change_px > alpha * reference_px_) return false;
  const auto held = static_cast<double>(queue_.size());
  if (queue_.size() < static_cast<std::size_t>(options_.queue)) {
    reference_px_ = (held * reference_px_ + change_px) / (held + 1);
  } else {
    reference_px_ = (held * reference_px_ - queue_.front() + change_px) / held;
    queue_.pop_front();
  }
  queue_.push_back(change_px);
  return true;
}

}  // namespace semvslam
