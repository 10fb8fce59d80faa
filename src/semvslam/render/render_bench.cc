#include <benchmark/benchmark.h>

#include "semvslam/render/scene_source.h"

namespace semvslam {
namespace {

/// Frames per second at 640x480 with noise; argument = threads.
void render_frames(benchmark::State& state, const char* people, const char* motion) {
  SceneOptions options;
  options.people = people;
  options.motion = motion;
  options.threads = static_cast<int>(state.range(0));
  auto scene = RenderedScene::create(options);
  if (!scene) return state.SkipWithError(scene.error().message.c_str());
  std::size_t index = 0;
  for (auto _ : state) benchmark::DoNotOptimize(scene->render(index += 7).frame.gray.data);
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(render_frames, walking_halfsphere, "walking", "halfsphere")
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(render_frames, empty_tour, "none", "tour")
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void create_scene(benchmark::State& state) {
  SceneOptions options;
  for (auto _ : state) benchmark::DoNotOptimize(RenderedScene::create(options).ok());
}
BENCHMARK(create_scene)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace semvslam
