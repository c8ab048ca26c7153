// Speed and accuracy of triangulating and cleaning a sheet of n x n cells that every camera of a ring sees, a
// fifth of the observations wrong. With gaps, half of the observations are missing and some are off by up to
// 2 px. Counters: mean error in mm, and the share of cells that got a point.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include "tests/triangulation/plain_triangulation.h"
#include "tests/triangulation/synthetic_views.h"
#include "triangulation/clean.h"

namespace weft {
namespace {

std::vector<ViewObservations> SpoiledViews(const Rig& rig, const std::vector<testing::NodeTruth>& truth) {
  std::vector<ViewObservations> views = testing::Observe(rig, truth, 0.15, 1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  for (ViewObservations& view : views) {
    for (Observation& o : view.observations) {
      if (unit(random) < 0.2) o.x_px += 400 * (unit(random) - 0.5), o.y_px += 400 * (unit(random) - 0.5);
    }
  }
  return views;
}

std::vector<ViewObservations> WithGaps(std::vector<ViewObservations> views) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (ViewObservations& view : views) {
    std::erase_if(view.observations, [&](const Observation&) { return unit(random) < 0.5; });
    for (Observation& o : view.observations) {
      if (unit(random) < 0.15) o.x_px += 4 * (unit(random) - 0.5), o.y_px += 4 * (unit(random) - 0.5);
    }
  }
  return views;
}

// The baseline: the same by plain functions in doubles.
void PlainSheet(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  const Rig rig = testing::RingRig(static_cast<int>(state.range(1)));
  const std::vector<testing::NodeTruth> truth = testing::BentSheet(n, n);
  const std::vector<ViewObservations> views = SpoiledViews(rig, truth);
  std::map<BoardNode, testing::PlainPoint> points;
  for (auto _ : state) points = testing::PlainTriangulate(rig, views, {});
  double sum_mm = 0;
  for (const auto& [node, p] : points)
    sum_mm += (p.point.position_mm - truth[node.row * n + node.col].position_mm).norm();
  state.counters["error_mm"] = sum_mm / static_cast<double>(points.size());
  state.counters["cells"] = static_cast<double>(truth.size());
}
BENCHMARK(PlainSheet)->Args({100, 84})->ArgNames({"n", "cameras"})->Unit(benchmark::kMillisecond);

void TriangulateSheet(benchmark::State& state, bool has_gaps) {
  const int n = static_cast<int>(state.range(0));
  const Rig rig = testing::RingRig(static_cast<int>(state.range(1)));
  const std::vector<testing::NodeTruth> truth = testing::BentSheet(n, n);
  std::vector<ViewObservations> views = SpoiledViews(rig, truth);
  if (has_gaps) views = WithGaps(std::move(views));
  Cloud cloud;
  tbb::task_arena(static_cast<int>(state.range(2))).execute([&] {
    for (auto _ : state) cloud = *Triangulate(rig, views, {});
  });
  double sum_mm = 0;
  for (const CloudPoint& p : cloud.points) {
    sum_mm += (p.position_mm - truth[p.node.row * n + p.node.col].position_mm).norm();
  }
  state.counters["error_mm"] = sum_mm / cloud.points.size();
  state.counters["found"] = static_cast<double>(cloud.points.size()) / truth.size();
  state.counters["cells"] = static_cast<double>(truth.size());
}
BENCHMARK_CAPTURE(TriangulateSheet, whole, false)
    ->Args({100, 8, 1})
    ->Args({100, 30, 1})
    ->Args({100, 84, 1})
    ->Args({300, 30, 1})
    ->Args({300, 30, 2})
    ->Args({316, 84, 1})  // the goal: at most 250 ms
    ->ArgNames({"n", "cameras", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(TriangulateSheet, gaps, true)
    ->Args({200, 84, 1})
    ->ArgNames({"n", "cameras", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void CleanSheet(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  Cloud cloud;
  for (const testing::NodeTruth& t : testing::BentSheet(n, n)) {
    cloud.points.push_back({t.position_mm, t.node, 5, 0.1});
    if (t.node.col % 17 == 3) cloud.points.back().position_mm.x() += 5.0 * (t.node.row % 11);
  }
  for (auto _ : state) benchmark::DoNotOptimize(CleanCloud(cloud, {}));
}
BENCHMARK(CleanSheet)->Arg(300)->ArgName("n")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
