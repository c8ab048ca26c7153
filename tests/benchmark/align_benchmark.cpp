// Speed and accuracy of registering one frame, on a rolled and wrinkled sheet of n x n vertices of which a
// quarter is hidden in round patches. Counters: mean errors in mm of hidden and visible vertices.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include "tests/alignment/paper_options.h"
#include "tests/benchmark/wrinkled_sheet.h"

namespace weft {
namespace {

void Align(benchmark::State& state, const AlignOptions& options) {
  const int n = static_cast<int>(state.range(0));
  const testing::MeasuredSheet frame = testing::WrinkledSheet(n);
  const AlignmentModel model(frame.garment);
  AlignResult result;
  tbb::task_arena(static_cast<int>(state.range(1))).execute([&] {
    for (auto _ : state) result = *weft::Align(model, frame.targets, options);
  });
  double sum_mm[2] = {}, count[2] = {};
  for (int v = 0; v < n * n; ++v) {
    const bool hidden = testing::InHiddenPatch(v, n);
    sum_mm[hidden] += (result.mesh.vertices_mm[v] - frame.truth[v]).norm();
    ++count[hidden];
  }
  state.counters["visible_mm"] = sum_mm[0] / count[0];
  state.counters["hidden_mm"] = sum_mm[1] / count[1];
  state.counters["vertices"] = n * n;
}
BENCHMARK_CAPTURE(Align, best, AlignOptions{})
    ->ArgsProduct({{100, 320}, {1, 2}})
    ->ArgNames({"n", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Align, paper, testing::PaperAlignment())
    ->ArgsProduct({{100, 320}, {1}})
    ->ArgNames({"n", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void BuildModel(benchmark::State& state) {
  const testing::MeasuredSheet frame = testing::WrinkledSheet(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(AlignmentModel(frame.garment));
}
BENCHMARK(BuildModel)->Arg(320)->ArgName("n")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
