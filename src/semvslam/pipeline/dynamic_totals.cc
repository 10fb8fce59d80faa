#include "semvslam/pipeline/slam.h"

namespace semvslam {
namespace {

template <std::size_t N, typename From>
void accumulate(std::array<std::uint64_t, N>& sums, const std::array<From, N>& values) {
  for (std::size_t i = 0; i < N; ++i) sums[i] += static_cast<std::uint64_t>(values[i]);
}

}  // namespace

void DynamicTotals::add(const DynamicRecord& record) {
  accumulate(verdicts, record.verdicts);
  accumulate(reasons, record.reasons);
  accumulate(track_reasons, record.track_reasons);
  ++mask_sources[static_cast<std::size_t>(record.mask_source)];
  ++fail_opens[static_cast<std::size_t>(record.fail_open)];
  if (record.mask_source != MaskSource::kNone) {
    ++segmentation_states[static_cast<std::size_t>(record.repair.quality.state)];
    mask_age_frames += static_cast<std::uint64_t>(record.mask_age_frames);
  }
  restored_instances += static_cast<std::uint64_t>(record.repair.restored_instances);
  extended_instances += static_cast<std::uint64_t>(record.repair.extended_instances);
  moving_instances += static_cast<std::uint64_t>(record.moving_instances);
  moving_regions += static_cast<std::uint64_t>(record.moving_regions);
  masked_share += record.masked_share;
}

}  // namespace semvslam
