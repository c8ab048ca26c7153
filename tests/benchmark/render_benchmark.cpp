// Seconds per megapixel of a rendered view, and of the truth that goes with it.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include <utility>

#include "simulation/take_presets.h"

namespace {

struct Studio {
  weft::SyntheticTake take;
  weft::TakeFrame frame;
};

const Studio& TheStudio() {
  static const Studio studio = [] {
    weft::SyntheticTakeOptions options = *weft::SyntheticPreset("quickstart", 1);
    options.performance.frames = 1;
    weft::SyntheticTake take = *weft::SyntheticTake::Make(options);
    weft::TakeFrame frame = *take.Next();
    return Studio{std::move(take), std::move(frame)};
  }();
  return studio;
}

void CountMegapixels(benchmark::State& state) {
  const weft::CameraModel& camera = TheStudio().take.rig().cameras[0];
  state.counters["s_per_megapixel"] =
      benchmark::Counter(1e-6 * camera.width_px * camera.height_px,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void Render(benchmark::State& state, int threads, const weft::StudioScene& scene,
            const weft::CameraOptions& options) {
  tbb::task_arena arena(threads);
  arena.execute([&] {
    for (auto _ : state)
      benchmark::DoNotOptimize(weft::RenderView(scene, TheStudio().take.rig().cameras[0], options, 0));
  });
  CountMegapixels(state);
}

// The baseline: frozen and in focus, on `threads` threads.
void BM_RenderView(benchmark::State& state) {
  Render(state, static_cast<int>(state.range(0)), TheStudio().frame.scene, TheStudio().take.options().camera);
}
BENCHMARK(BM_RenderView)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

// With an exposure of so many ms.
void BM_RenderMoving(benchmark::State& state) {
  const weft::StudioScene scene =
      *TheStudio().frame.scene.Exposed(0, static_cast<double>(state.range(0)) / 1000);
  Render(state, 1, scene, TheStudio().take.options().camera);
}
BENCHMARK(BM_RenderMoving)->Arg(2)->Arg(8)->Unit(benchmark::kMillisecond);

void BM_RenderDefocused(benchmark::State& state) {
  weft::CameraOptions options = TheStudio().take.options().camera;
  options.lens.f_number = 5.6;
  Render(state, 1, TheStudio().frame.scene, options);
}
BENCHMARK(BM_RenderDefocused)->Unit(benchmark::kMillisecond);

// The part of it that casts rays.
void BM_TraceView(benchmark::State& state) {
  tbb::task_arena arena(1);
  arena.execute([&] {
    for (auto _ : state)
      benchmark::DoNotOptimize(weft::TraceView(TheStudio().frame.scene, TheStudio().take.rig().cameras[0]));
  });
  CountMegapixels(state);
}
BENCHMARK(BM_TraceView)->Unit(benchmark::kMillisecond);

void BM_LightScene(benchmark::State& state) {
  const weft::StudioScene& lit = TheStudio().frame.scene;
  tbb::task_arena arena(1);
  arena.execute([&] {
    for (auto _ : state)
      benchmark::DoNotOptimize(
          weft::StudioScene::Build({lit.mesh(), {}}, lit.print(), lit.board(), {}, lit.options()));
  });
}
BENCHMARK(BM_LightScene)->Unit(benchmark::kMillisecond);

void BM_ViewTruth(benchmark::State& state) {
  const weft::StudioScene& scene = TheStudio().frame.scene;
  const weft::PrintLocator locator(scene.print());
  tbb::task_arena arena(1);
  arena.execute([&] {
    for (auto _ : state)
      benchmark::DoNotOptimize(
          weft::FindViewTruth(scene.mesh(), locator, scene.rays(), TheStudio().take.rig().cameras[0]));
  });
}
BENCHMARK(BM_ViewTruth)->Unit(benchmark::kMillisecond);

}  // namespace
