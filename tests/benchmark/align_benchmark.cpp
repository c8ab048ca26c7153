// Speed and accuracy of registering one frame, on a rolled and wrinkled sheet of n x n vertices of which a
// quarter is hidden in round patches. Counters: mean errors in mm of hidden and visible vertices.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

// Wrinkles 1.5 mm deep and 30 mm long on a cylinder. They stretch the cloth by about 5 % at the most.
Eigen::Vector3d Wrinkled(const Eigen::Vector3d& p) {
  const double radius_mm = 150 + 1.5 * std::sin(p.x() / 4.8) * std::sin(p.y() / 11);
  return {radius_mm * std::sin(p.x() / 150), p.y(), -radius_mm * std::cos(p.x() / 150)};
}

// Patches of 40 cells' pitch and 11.3 cells' radius: a quarter of the surface.
bool IsHidden(int v, int cols) {
  const double row = v / cols % 40 - 20, col = v % cols % 40 - 20;
  return std::hypot(row, col) < 11.3;
}

struct Frame {
  Template garment;
  std::vector<Eigen::Vector3d> truth;
  std::vector<VertexTarget> targets;
};

Frame SomeFrame(int n) {
  Frame frame;
  frame.garment = testing::SheetTemplate(testing::FlatSheet(n, n));
  frame.truth = testing::Mapped(frame.garment.rest.vertices_mm, Wrinkled);
  frame.targets = testing::Measure(frame.truth, 0.3, 1, [&](int v) { return !IsHidden(v, n); });
  return frame;
}

void Align(benchmark::State& state, const AlignOptions& options) {
  const int n = static_cast<int>(state.range(0));
  const Frame frame = SomeFrame(n);
  const AlignmentModel model(frame.garment);
  AlignResult result;
  tbb::task_arena(static_cast<int>(state.range(1))).execute([&] {
    for (auto _ : state) result = *weft::Align(model, frame.targets, options);
  });
  double sum_mm[2] = {}, count[2] = {};
  for (int v = 0; v < n * n; ++v) {
    const bool hidden = IsHidden(v, n);
    sum_mm[hidden] += (result.mesh.vertices_mm[v] - frame.truth[v]).norm();
    ++count[hidden];
  }
  state.counters["visible_mm"] = sum_mm[0] / count[0];
  state.counters["hidden_mm"] = sum_mm[1] / count[1];
  state.counters["vertices"] = n * n;
}
BENCHMARK_CAPTURE(Align, best, BestPreset())
    ->ArgsProduct({{100, 320}, {1, 2}})
    ->ArgNames({"n", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Align, paper, PaperPreset())
    ->ArgsProduct({{100, 320}, {1}})
    ->ArgNames({"n", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void BuildModel(benchmark::State& state) {
  const Frame frame = SomeFrame(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(AlignmentModel(frame.garment));
}
BENCHMARK(BuildModel)->Arg(320)->ArgName("n")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
