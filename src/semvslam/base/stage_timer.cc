#include "semvslam/base/stage_timer.h"

#include <algorithm>
#include <cmath>

namespace semvslam {

void StageTimer::add_ms(double ms) {
  if (!(ms > 0) || !std::isfinite(ms)) ms = 0;
  int bin = 0;
  if (ms > kSmallestMs) {
    static const double per_log = 1.0 / std::log(kRatio);
    bin = std::min(kBins - 1, static_cast<int>(std::log(ms / kSmallestMs) * per_log));
  }
  std::lock_guard lock(mutex_);
  ++count_;
  sum_ms_ += ms;
  max_ms_ = std::max(max_ms_, ms);
  ++bins_[static_cast<std::size_t>(bin)];
}

double StageTimer::quantile_ms(double share) const {
  // The smallest duration that at least `share` of all calls did not exceed.
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    seen += bins_[static_cast<std::size_t>(bin)];
    if (seen >= wanted) return std::min(max_ms_, kSmallestMs * std::pow(kRatio, bin + 0.5));
  }
  return max_ms_;
}

StageSummary StageTimer::summary() const {
  std::lock_guard lock(mutex_);
  if (count_ == 0) return {.name = name_};
  return {.name = name_,
          .count = count_,
          .mean_ms = sum_ms_ / static_cast<double>(count_),
          .median_ms = quantile_ms(0.5),
          .p95_ms = quantile_ms(0.95),
          .max_ms = max_ms_};
}

StageTimer& StageTimers::operator[](std::string_view name) {
  std::lock_guard lock(mutex_);
  for (Named& stage : stages_)
    if (stage.name == name) return stage.timer;
  return stages_.emplace_back(name).timer;
}

std::vector<StageSummary> StageTimers::summaries() const {
  std::lock_guard lock(mutex_);
  std::vector<StageSummary> out;
  for (const Named& stage : stages_) out.push_back(stage.timer.summary());
  return out;
}

}  // namespace semvslam
