#include "semvslam/apps/run_statistics.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "semvslam/base/ranked.h"

namespace semvslam {
namespace {

using Json = nlohmann::ordered_json;

Json stage_to_json(const StageSummary& s) {
  return {{"count", s.count}, {"mean", s.mean_ms}, {"median", s.median_ms}, {"p95", s.p95_ms}, {"max", s.max_ms}};
}

double per_frame(double seconds, std::uint64_t frames) {
  return frames == 0 ? 0 : seconds * 1e3 / static_cast<double>(frames);
}

/// Null when there is nothing.
Json median_of(std::vector<double> values) { return values.empty() ? Json() : Json(median(std::span(values))); }

template <typename Name, std::size_t N>
Json counts(const std::array<std::uint64_t, N>& values) {
  Json json = Json::object();
  for (std::size_t i = 0; i < N; ++i) json[std::string(to_string(static_cast<Name>(i)))] = values[i];
  return json;
}

Json dynamic_to_json(const DynamicTotals& d, std::uint64_t frames) {
  std::uint64_t masked = 0;
  for (std::size_t i = 1; i < kMaskSources; ++i) masked += d.mask_sources[i];
  const auto mean = [](double sum, std::uint64_t n) { return n == 0 ? 0.0 : sum / static_cast<double>(n); };
  return {{"features", counts<FeatureVerdict>(d.verdicts)},
          {"reasons", counts<FeatureReason>(d.reasons)},
          {"track_reasons", counts<MotionReason>(d.track_reasons)},
          {"mask_sources", counts<MaskSource>(d.mask_sources)},
          {"segmentation_states", counts<SegmentationState>(d.segmentation_states)},
          {"fail_open", counts<FailOpen>(d.fail_opens)},
          {"restored_instances", d.restored_instances},
          {"extended_instances", d.extended_instances},
          {"moving_instances", d.moving_instances},
          {"moving_regions", d.moving_regions},
          {"mask_age_frames", mean(static_cast<double>(d.mask_age_frames), masked)},
          {"masked_share", mean(d.masked_share, frames)}};
}

Json sub_maps_to_json(const SlamStatistics& slam) {
  Json apart = Json::array();
  for (const SubMapStatistics& s : slam.apart)
    apart.push_back({{"number", number_of(s.sub_map)},
                     {"tracked", s.tracked},
                     {"key_frames", s.key_frames},
                     {"landmarks", s.landmarks}});
  return {{"begun", slam.sub_maps_begun},
          {"joined", slam.sub_maps_joined},
          {"main", number_of(slam.sub_map)},
          {"apart", apart}};
}

}  // namespace

std::string format_statistics(const RunRecord& run, const SlamStatistics& slam) {
  Json stages = Json::object();
  stages["input"] = stage_to_json(run.input);
  for (const StageSummary& stage : slam.stages) stages[stage.name] = stage_to_json(stage);
  const double share = run.read == 0 ? 0 : static_cast<double>(slam.tracked) / static_cast<double>(run.read);
  Json json = {{"version", SEMVSLAM_VERSION},
               {"sequence", run.sequence},
               {"mode", run.mode},
               {"deterministic", run.deterministic},
               {"realtime", run.realtime},
               {"end", run.end},
               {"frames", run.read},
               {"skipped", run.skipped},
               {"dropped", run.dropped},
               {"tracked", slam.tracked},
               {"lost", slam.lost},
               {"tracked_share", share},
               {"key_frames", slam.key_frames},
               {"landmarks", slam.landmarks},
               {"relocalised", slam.relocalised},
               {"revisits", slam.revisits},
               {"loops", slam.loops},
               {"sub_maps", sub_maps_to_json(slam)},
               {"dynamic", dynamic_to_json(slam.dynamic, slam.frames)},
               {"notices", slam.notices},
               {"stages_ms", stages},
               {"start_up_s", run.start_up_s},
               {"wall_s", run.wall_s},
               {"cpu_s", run.cpu_s},
               {"cpu_ms_per_frame", per_frame(run.cpu_s, run.read)},
               {"frames_per_s", run.wall_s > 0 ? static_cast<double>(run.read) / run.wall_s : 0.0},
               {"peak_memory_mb", static_cast<double>(run.peak_memory_bytes) / 1e6}};
  if (!run.map.empty())
    json["saved_map"] = {{"file", run.map},
                         {"key_frames", slam.loaded_key_frames},
                         {"landmarks", slam.loaded_landmarks},
                         {"load_s", run.map_load_s}};
  if (run.truth)
    json["truth"] = {{"frames", run.truth->frames},
                     {"kept_on_moving", run.truth->kept_on_moving.value()},
                     {"tracked_on_moving", run.truth->tracked_on_moving.value()},
                     {"static_dropped", run.truth->static_dropped.value()},
                     {"clear_static_dropped", run.truth->clear_static_dropped.value()},
                     {"static_barred", run.truth->static_barred.value()},
                     {"pixel_recall", median_of(run.truth->pixel_recalls)},
                     {"pixel_precision", median_of(run.truth->pixel_precisions)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<std::string> format_apart(const SlamStatistics& slam) {
  std::vector<std::string> lines;
  for (const SubMapStatistics& s : slam.apart)
    lines.push_back(
        fmt::format("sub-map {0} was never joined with sub-map {1}, whose results these are: {2} frames, {3} "
                    "key frames, {4} landmarks in trajectory.{0}.txt, keyframes.{0}.txt, map.{0}.ply",
                    number_of(s.sub_map), number_of(slam.sub_map), s.tracked, s.key_frames, s.landmarks));
  return lines;
}

std::string format_summary(const RunRecord& run, const SlamStatistics& slam) {
  std::string out = fmt::format("{} frames, {} tracked, {} lost", run.read, slam.tracked, slam.lost);
  if (run.skipped > 0) out += fmt::format(", {} skipped as unusable (see run.log)", run.skipped);
  if (run.dropped > 0) out += fmt::format(", {} dropped to keep pace", run.dropped);
  out += fmt::format("; {} key frames, {} landmarks\n", slam.key_frames, slam.landmarks);
  for (const std::string& line : format_apart(slam)) out += line + "\n";
  if (!run.map.empty())
    out += fmt::format("{}: began with {} key frames, {} landmarks, loaded in {:.2f} s\n", run.map,
                       slam.loaded_key_frames, slam.loaded_landmarks, run.map_load_s);
  for (const StageSummary& stage : slam.stages)
    if (stage.name == "tracking" || stage.name == "mapping" || stage.name == "segment")
      out += fmt::format("{:<9} mean {:.2f}  median {:.2f}  p95 {:.2f}  max {:.2f} ms\n", stage.name, stage.mean_ms,
                         stage.median_ms, stage.p95_ms, stage.max_ms);
  out += fmt::format("wall {:.2f} s, CPU {:.2f} s ({:.2f} ms per frame), peak memory {:.0f} MB\n", run.wall_s,
                     run.cpu_s, per_frame(run.cpu_s, run.read), static_cast<double>(run.peak_memory_bytes) / 1e6);
  return out;
}

}  // namespace semvslam
