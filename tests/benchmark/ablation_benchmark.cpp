// What each stage of the alignment is worth: time and error with it and without. Counters: errors in mm of
// hidden and visible vertices against the truth, pairs of faces that intersect in the result.
// On a wrinkled sheet of which a quarter is hidden; or on a frame of your own, with WEFT_ABLATION_TEMPLATE (a
// template's folder), WEFT_ABLATION_TARGETS (points with template_vertex, or a cloud) and WEFT_ABLATION_TRUTH
// (a mesh) in the environment.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <tuple>
#include <utility>

#include "alignment/untangle/self_intersection.h"
#include "base/median.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "tests/alignment/paper_options.h"
#include "tests/benchmark/wrinkled_sheet.h"

namespace weft {
namespace {

template <typename Value>
Value OrExit(absl::StatusOr<Value> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "ablation: %s\n", value.status().ToString().c_str());
  std::exit(2);
}

testing::MeasuredSheet LoadFrame() {
  const char *garment = std::getenv("WEFT_ABLATION_TEMPLATE"),
             *targets = std::getenv("WEFT_ABLATION_TARGETS"), *truth = std::getenv("WEFT_ABLATION_TRUTH");
  if (!garment || !targets || !truth) return testing::WrinkledSheet(160);
  testing::MeasuredSheet frame;
  frame.garment = OrExit(ReadTemplate(garment));
  frame.truth = OrExit(ReadMesh(truth)).vertices_mm;
  frame.targets = OrExit(TargetsFromPly(OrExit(ReadPly(targets)), targets, frame.garment)).targets;
  return frame;
}

// Mean and median.
std::pair<double, double> Summary(std::vector<double> values) {
  if (values.empty()) return {0, 0};
  double sum = 0;
  for (const double v : values) sum += v;
  return {sum / static_cast<double>(values.size()), Median(std::move(values))};
}

void Ablate(benchmark::State& state, AlignOptions options, const std::function<void(AlignOptions*)>& change) {
  static const testing::MeasuredSheet frame = LoadFrame();
  static const AlignmentModel model(frame.garment);
  change(&options);
  AlignResult result;
  tbb::task_arena(1).execute([&] {
    for (auto _ : state) result = OrExit(weft::Align(model, frame.targets, options));
  });
  std::vector<bool> visible(frame.truth.size(), false);
  for (const VertexTarget& t : frame.targets) visible[t.vertex] = true;
  std::vector<double> error_mm[2];
  for (size_t v = 0; v < frame.truth.size(); ++v) {
    error_mm[visible[v]].push_back((result.mesh.vertices_mm[v] - frame.truth[v]).norm());
  }
  std::tie(state.counters["hidden_mean_mm"], state.counters["hidden_median_mm"]) = Summary(error_mm[0]);
  state.counters["visible_mean_mm"] = Summary(error_mm[1]).first;
  state.counters["pairs"] =
      static_cast<double>(FindSelfIntersections(result.mesh.vertices_mm, frame.garment.rest.faces).size());
}

void Register(const std::string& name, const AlignOptions& options,
              const std::function<void(AlignOptions*)>& change) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) { Ablate(state, options, change); })
      ->Iterations(1)
      ->Unit(benchmark::kMillisecond);
}

const int kRegistered = [] {
  Register("best", AlignOptions{}, [](AlignOptions*) {});
  Register("best/filled_counts_fully", AlignOptions{},
           [](AlignOptions* o) { o->detection.filled_weight = 1; });
  Register("best/bending_as_paper", AlignOptions{},
           [](AlignOptions* o) { o->elastic.distortion.bending = 0.5; });
  Register("best/soft_from_the_start", AlignOptions{}, [](AlignOptions* o) { o->first_bending = 0; });
  Register("best/all_weigh_the_same", AlignOptions{},
           [](AlignOptions* o) { o->detection.weigh_by_sigma = false; });
  Register("best/outliers_stay", AlignOptions{}, [](AlignOptions* o) { o->robust.max_rounds = 0; });
  Register("best/with_push", AlignOptions{}, [](AlignOptions* o) { o->push.weight = 1; });
  Register("best/not_untangled", AlignOptions{},
           [](AlignOptions* o) { o->remove_self_intersections = false; });
  Register("best/fill_and_rigid_fit_alone", AlignOptions{}, [](AlignOptions* o) {
    o->elastic.max_iterations = 1;
    o->remove_self_intersections = false;
  });
  Register("paper", testing::PaperAlignment(), [](AlignOptions*) {});
  Register("paper/without_push", testing::PaperAlignment(), [](AlignOptions* o) { o->push.weight = 0; });
  Register("paper/measured_not_frozen", testing::PaperAlignment(),
           [](AlignOptions* o) { o->freeze_observed = false; });
  Register("paper/not_untangled", testing::PaperAlignment(),
           [](AlignOptions* o) { o->remove_self_intersections = false; });
  return 0;
}();

}  // namespace
}  // namespace weft
