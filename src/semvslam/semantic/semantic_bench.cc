#include <benchmark/benchmark.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "semvslam/semantic/roi_align.h"
#include "semvslam/semantic/segmenter.h"

namespace semvslam {
namespace {

/// Image in to masks out. SEMVSLAM_MODELS = folder of model.json, SEMVSLAM_IMAGE = any picture, SEMVSLAM_PRECISION and
/// SEMVSLAM_WIDTH = instead of the machine's own as in `run`; argument: threads.
void BM_segment(benchmark::State& state) {
  const char* models = std::getenv("SEMVSLAM_MODELS");
  const char* file = std::getenv("SEMVSLAM_IMAGE");
  SegmenterOptions options;
  options.model = models ? models : "models";
  options.threads = static_cast<int>(state.range(0));
  if (const char* precision = std::getenv("SEMVSLAM_PRECISION")) options.precision = precision;
  if (const char* width = std::getenv("SEMVSLAM_WIDTH")) options.input_width_px = std::atoi(width);
  StageTimers timers;
  auto segmenter = make_segmenter(options, RoleTable(), &timers);
  if (!segmenter) return state.SkipWithError(segmenter.error().message.c_str());
  const cv::Mat image = cv::imread(file ? file : options.model + "/golden/people.jpg");
  std::size_t found = 0;
  for (auto _ : state) {
    const auto s = (*segmenter)->segment({FrameId(0), TimeStamp{}, image, ""});
    if (!s) return state.SkipWithError(s.error().message.c_str());
    found = s->instances.size();
  }
  state.counters["instances"] = static_cast<double>(found);
  for (const StageSummary& s : timers.summaries()) state.counters[s.name.substr(8)] = s.median_ms;
}
BENCHMARK(BM_segment)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_roi_align(benchmark::State& state) {
  const int channels = 96;
  const std::vector<float> map(48 * 64 * channels, 0.5f);
  std::vector<float> out(7 * 7 * channels);
  for (auto _ : state) {
    roi_align({map.data(), 48, 64, 8}, channels, {20, 30, 110, 140}, 7, out.data());
    benchmark::DoNotOptimize(out.data());
  }
}
BENCHMARK(BM_roi_align);

}  // namespace
}  // namespace semvslam
