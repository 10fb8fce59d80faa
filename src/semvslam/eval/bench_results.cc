#include "semvslam/eval/bench_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace semvslam {
namespace {

using Number = std::optional<double>;

template <ErrorStatistics RunScore::*kErrors, double ErrorStatistics::*kValue>
Number error(const BenchRun& run) {
  return run.score ? Number(*run.score.*kErrors.*kValue) : std::nullopt;
}

template <double TruthShares::*kValue>
Number share(const BenchRun& run) {
  return run.truth ? Number(*run.truth.*kValue) : std::nullopt;
}

template <double BenchRun::*kValue>
Number value(const BenchRun& run) {
  return run.*kValue;
}

template <std::uint64_t BenchRun::*kValue>
Number count(const BenchRun& run) {
  return static_cast<double>(run.*kValue);
}

Number tracked_share(const BenchRun& run) {
  return run.frames == 0 ? 0 : static_cast<double>(run.tracked) / static_cast<double>(run.frames);
}

Number way(const BenchRun& run) { return run.way_m > 0 ? Number(run.way_m) : std::nullopt; }

Number share_of_way(const BenchRun& run) {
  return run.score && run.way_m > 0 ? Number(run.score->ate_m.rmse / run.way_m) : std::nullopt;
}

using S = RunScore;
using E = ErrorStatistics;

constexpr std::array kNumbers = {
    BenchNumber{"ate_rmse_m", error<&S::ate_m, &E::rmse>},
    BenchNumber{"ate_mean_m", error<&S::ate_m, &E::mean>},
    BenchNumber{"ate_median_m", error<&S::ate_m, &E::median>},
    BenchNumber{"ate_sd_m", error<&S::ate_m, &E::sd>},
    BenchNumber{"ate_max_m", error<&S::ate_m, &E::max>},
    BenchNumber{"ate_share_of_way", share_of_way},
    BenchNumber{"rpe_translation_rmse_m", error<&S::rpe_translation_m, &E::rmse>},
    BenchNumber{"rpe_translation_mean_m", error<&S::rpe_translation_m, &E::mean>},
    BenchNumber{"rpe_translation_median_m", error<&S::rpe_translation_m, &E::median>},
    BenchNumber{"rpe_translation_sd_m", error<&S::rpe_translation_m, &E::sd>},
    BenchNumber{"rpe_rotation_rmse_deg", error<&S::rpe_rotation_deg, &E::rmse>},
    BenchNumber{"rpe_rotation_mean_deg", error<&S::rpe_rotation_deg, &E::mean>},
    BenchNumber{"rpe_rotation_median_deg", error<&S::rpe_rotation_deg, &E::median>},
    BenchNumber{"rpe_rotation_sd_deg", error<&S::rpe_rotation_deg, &E::sd>},
    BenchNumber{"way_m", way},
    BenchNumber{"frames", count<&BenchRun::frames>},
    BenchNumber{"tracked", count<&BenchRun::tracked>},
    BenchNumber{"tracked_share", tracked_share},
    BenchNumber{"lost", count<&BenchRun::lost>},
    BenchNumber{"skipped", count<&BenchRun::skipped>},
    BenchNumber{"tracking_mean_ms", value<&BenchRun::tracking_mean_ms>},
    BenchNumber{"tracking_p95_ms", value<&BenchRun::tracking_p95_ms>},
    BenchNumber{"frames_per_s", value<&BenchRun::frames_per_s>},
    BenchNumber{"cpu_ms_per_frame", value<&BenchRun::cpu_ms_per_frame>},
    BenchNumber{"peak_memory_mb", value<&BenchRun::peak_memory_mb>},
    BenchNumber{"start_up_s", value<&BenchRun::start_up_s>},
    BenchNumber{"wall_s", value<&BenchRun::wall_s>},
    BenchNumber{"kept_on_moving", share<&TruthShares::kept_on_moving>},
    BenchNumber{"tracked_on_moving", share<&TruthShares::tracked_on_moving>},
    BenchNumber{"static_dropped", share<&TruthShares::static_dropped>},
    BenchNumber{"clear_static_dropped", share<&TruthShares::clear_static_dropped>},
    BenchNumber{"static_barred", share<&TruthShares::static_barred>},
};

}  // namespace

std::span<const BenchNumber> bench_numbers() { return kNumbers; }

const BenchNumber& bench_number(std::string_view name) {
  const auto it = std::find_if(kNumbers.begin(), kNumbers.end(), [&](const BenchNumber& n) { return n.name == name; });
  if (it == kNumbers.end()) throw std::logic_error(fmt::format("bench: no number is called {}", name));
  return *it;
}

Spread BenchCell::over(const BenchNumber& number) const {
  std::vector<double> values;
  for (const BenchRun* run : good)
    if (const Number v = number.of(*run)) values.push_back(*v);
  return spread_of(values);
}

const BenchRun* BenchCell::middle() const {
  std::vector<const BenchRun*> scored;
  for (const BenchRun* run : good)
    if (run->score) scored.push_back(run);
  if (scored.empty()) return nullptr;
  std::stable_sort(scored.begin(), scored.end(),
                   [](const BenchRun* a, const BenchRun* b) { return a->score->ate_m.rmse < b->score->ate_m.rmse; });
  return scored[(scored.size() - 1) / 2];
}

std::vector<BenchCell> cells_of(const BenchResults& results) {
  std::vector<BenchCell> cells;
  for (const std::string& sequence : results.sequences)
    for (const std::string& mode : results.modes) {
      BenchCell cell{sequence, mode, {}, {}};
      for (const BenchRun& run : results.runs)
        if (run.sequence == sequence && run.mode == mode)
          (run.failure.empty() ? cell.good : cell.failed).push_back(&run);
      if (!cell.good.empty() || !cell.failed.empty()) cells.push_back(std::move(cell));
    }
  return cells;
}

const BenchCell* find_cell(const std::vector<BenchCell>& cells, std::string_view sequence, std::string_view mode) {
  const auto it = std::find_if(cells.begin(), cells.end(),
                               [&](const BenchCell& c) { return c.sequence == sequence && c.mode == mode; });
  return it == cells.end() ? nullptr : &*it;
}

std::vector<std::string> broken_limits(const BenchRun& run, const BenchLimits& limits) {
  std::vector<std::string> out;
  if (!run.failure.empty() || (!limits.mode.empty() && limits.mode != run.mode)) return out;
  const std::string what = fmt::format("{} in mode {}, run {}", run.sequence, run.mode, run.number);
  const auto at_most = [&](std::string_view name, const Number& limit) {
    const Number v = bench_number(name).of(run);
    if (limit && !v) out.push_back(fmt::format("{}: has no {}, which may be {} at most", what, name, *limit));
    if (limit && v && !(*v <= *limit))
      out.push_back(fmt::format("{}: {} is {:.4g}, more than {}", what, name, *v, *limit));
  };
  at_most("ate_rmse_m", limits.ate_rmse_m);
  at_most("ate_share_of_way", limits.ate_share_of_way);
  const Number tracked = tracked_share(run);
  if (limits.tracked_share && !(*tracked >= *limits.tracked_share))
    out.push_back(fmt::format("{}: tracked_share is {:.4g}, less than {}", what, *tracked, *limits.tracked_share));
  return out;
}

}  // namespace semvslam
