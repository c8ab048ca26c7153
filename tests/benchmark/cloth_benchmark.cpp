// Speed of the cloth simulation: a step of a sheet of n x n cells of 5 mm that hangs from its upper border in
// folds. Counter: steps of 10,000 vertices per second. Baseline: SpMV, the multiplication with the
// stiffness matrix that every iteration of the solver does once.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "physics/garment_solver.h"
#include "simulation/cloth.h"

namespace weft {
namespace {

struct Curtain {
  Cloth cloth;
  std::vector<std::array<Eigen::Vector2d, 3>> flat_mm;
  std::vector<Eigen::Vector3d> start_mm;
  StepInput input;

  explicit Curtain(int n) {
    ClothOptions options;
    options.shape = ClothShape::kSheet;
    options.rows = options.cols = n, options.cell_mm = 5;
    cloth = *BuildCloth(options);
    for (const auto& p : cloth.print.of_face) flat_mm.push_back({5 * p[0], 5 * p[1], 5 * p[2]});
    for (const Eigen::Vector3d& p : cloth.rest.vertices_mm)
      start_mm.emplace_back(0.8 * p.x(), p.y(), 9 * std::sin(p.x() / 10));
    for (int j = 0; j < cloth.grid_cols; ++j) {
      input.held.push_back(cloth.vertex_at(0, j));
      input.held_at_mm.push_back(start_mm[input.held.back()]);
    }
  }
};

void Step(benchmark::State& state) {
  const Curtain curtain(static_cast<int>(state.range(0)));
  GarmentSolver solver(curtain.cloth.rest.faces, curtain.flat_mm, curtain.start_mm, 5, {});
  tbb::task_arena(static_cast<int>(state.range(1))).execute([&] {
    for (auto _ : state) benchmark::DoNotOptimize(solver.Step(1.2e-3, curtain.input));
  });
  state.counters["steps_of_10k_per_s"] = benchmark::Counter(
      static_cast<double>(state.iterations() * curtain.start_mm.size()) / 1e4, benchmark::Counter::kIsRate);
}
BENCHMARK(Step)
    ->ArgsProduct({{100, 316}, {1, 2}})
    ->ArgNames({"n", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void SpMV(benchmark::State& state) {
  const Curtain curtain(static_cast<int>(state.range(0)));
  Fabric fabric(static_cast<int>(curtain.start_mm.size()), curtain.cloth.rest.faces, curtain.flat_mm, {});
  fabric.Linearize(curtain.start_mm);
  std::vector<Eigen::Vector3f> p(curtain.start_mm.size(), Eigen::Vector3f(1, 2, 3)), out(p.size());
  tbb::task_arena(1).execute([&] {
    for (auto _ : state) fabric.Multiply(p, out);
  });
}
BENCHMARK(SpMV)->Arg(100)->Arg(316)->ArgName("n")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
