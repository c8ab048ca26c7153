// Seconds per megapixel of a rendered view, and of the truth that goes with it.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include "simulation/synthetic_take.h"

namespace {

const weft::SyntheticTake& Take() {
  static const weft::SyntheticTake take = [] {
    weft::SyntheticTakeOptions options = *weft::SyntheticPreset("quickstart", 1);
    options.motion.frames = 1;
    return *weft::SyntheticTake::Make(options);
  }();
  return take;
}

// On `threads` threads.
void BM_RenderView(benchmark::State& state) {
  tbb::task_arena arena(static_cast<int>(state.range(0)));
  arena.execute([&] {
    const weft::StudioScene scene = *Take().SceneAt(0);
    for (auto _ : state) benchmark::DoNotOptimize(Take().Render(scene, 0, 0));
  });
  const weft::CameraModel& camera = Take().rig().cameras[0];
  const double megapixels = 1e-6 * camera.width_px * camera.height_px;
  state.counters["s_per_megapixel"] = benchmark::Counter(
      megapixels, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(BM_RenderView)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

void BM_LightScene(benchmark::State& state) {
  tbb::task_arena arena(1);
  arena.execute([&] {
    for (auto _ : state) benchmark::DoNotOptimize(Take().SceneAt(0));
  });
}
BENCHMARK(BM_LightScene)->Unit(benchmark::kMillisecond);

void BM_ViewTruth(benchmark::State& state) {
  tbb::task_arena arena(1);
  arena.execute([&] {
    const weft::StudioScene scene = *Take().SceneAt(0);
    for (auto _ : state) benchmark::DoNotOptimize(Take().Truth(scene, 0));
  });
}
BENCHMARK(BM_ViewTruth)->Unit(benchmark::kMillisecond);

}  // namespace
