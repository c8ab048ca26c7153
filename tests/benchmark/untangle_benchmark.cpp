// Speed of finding and removing self-intersections on one core, on two wrinkled sheets of n x n vertices, one
// over the other: 200 704 faces at n = 225, where the search is to take less than 0.1 s. Baselines: the
// search without faces around common vertices (SelfIntersections), and the search twice, before and after,
// which is all that untangling a clean mesh would cost (IntersectingPairs).
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include "alignment/untangle/self_intersection.h"
#include "alignment/untangle/untangle.h"
#include "tests/alignment/untangle/intersecting_sheets.h"

namespace weft {
namespace {

// Two layers with dents that push the upper one through the lower: `dents` times 3 mm deep, 10 mm wide.
TriangleMesh Layers(int n, int dents) {
  const auto wrinkle = [](const Eigen::Vector3d& p) {
    return 1.5 * std::sin(p.x() / 4.8) * std::sin(p.y() / 11);
  };
  const double pitch = n * testing::kCellMm / (dents + 1);
  const auto below = [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(p.x(), p.y(), wrinkle(p)); };
  const auto above = [&](const Eigen::Vector3d& p) {
    double z = wrinkle(p) + 1;
    for (int i = 1; i <= dents; ++i) {
      const double r = std::hypot(p.x() - i * pitch, p.y() - i * pitch) / 10;
      z -= 4 * std::exp(-r * r);
    }
    return Eigen::Vector3d(p.x() + 0.7, p.y() + 0.4, z);
  };
  return testing::Joined(testing::Shaped(testing::FlatSheet(n, n), below),
                         testing::Shaped(testing::FlatSheet(n, n), above));
}

template <typename Find>
void Search(benchmark::State& state, const Find& find) {
  const TriangleMesh mesh = Layers(static_cast<int>(state.range(0)), 3);
  tbb::task_arena(1).execute([&] {
    for (auto _ : state) benchmark::DoNotOptimize(find(mesh.vertices_mm, mesh.faces));
  });
  state.counters["faces"] = static_cast<double>(mesh.faces.size());
}
BENCHMARK_CAPTURE(Search, SelfIntersections, FindSelfIntersections)
    ->Arg(225)
    ->ArgName("n")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Search, IntersectingPairs, FindIntersectingPairs)
    ->Arg(225)
    ->ArgName("n")
    ->Unit(benchmark::kMillisecond);

void Untangle(benchmark::State& state) {
  const TriangleMesh mesh = Layers(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  UntangleReport report;
  tbb::task_arena(1).execute([&] {
    for (auto _ : state) {
      std::vector<Eigen::Vector3d> vertices_mm = mesh.vertices_mm;
      report = *RemoveSelfIntersections(mesh.faces, {}, {}, &vertices_mm);
    }
  });
  state.counters["pairs_before"] = report.pairs_before;
  state.counters["pairs_after"] = report.pairs_after + report.vertex_pairs_after;
  state.counters["moved"] = report.moved_vertices;
  state.counters["max_move_mm"] = report.max_move_mm;
}
BENCHMARK(Untangle)->ArgsProduct({{225}, {0, 1, 3}})->ArgNames({"n", "dents"})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
