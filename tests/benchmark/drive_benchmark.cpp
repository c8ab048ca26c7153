// Speed of driving a garment by two cameras: cloth of 71 x 71 cells of 12 mm and of 141 x 141 of 6 mm, as
// many as a T-shirt has. Counters: ms of each stage, mean error in mm, and `ratio`, the time over that of the
// baseline, the product of two matrices of 768 x 768 doubles on one core, in the same run.
#include <benchmark/benchmark.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>

#include "alignment/align.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "base/median.h"
#include "base/stopwatch.h"
#include "pattern/decoder.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/observed_take.h"
#include "tests/benchmark/waving_cloth.h"

namespace weft {
namespace {

const testing::WavingCloth& ClothOf(int n) {
  static std::map<int, std::unique_ptr<testing::WavingCloth>> cloths;
  auto& cloth = cloths[n];
  if (cloth == nullptr) cloth = std::make_unique<testing::WavingCloth>(n);
  return *cloth;
}

constexpr int kSide = 768;
void Multiply(Eigen::MatrixXd& a, Eigen::MatrixXd& out) {
  out.noalias() = a * a.transpose();
  benchmark::DoNotOptimize(out.data());
}

// Of the baseline, the median of some.
double ReferenceMs() {
  static const double ms = [] {
    Eigen::MatrixXd a = Eigen::MatrixXd::Random(kSide, kSide), out(kSide, kSide);
    std::vector<double> times;
    for (int k = 0; k < 9; ++k) {
      const Stopwatch watch;
      Multiply(a, out);
      times.push_back(watch.Ms());
    }
    return Median(times);
  }();
  return ms;
}

class Drive {
 public:
  explicit Drive(const testing::WavingCloth& cloth)
      : cloth_(cloth), driver_(*SparseViewDriver::Create(cloth.garment(), cloth.avatar())) {}

  void Next(const std::vector<ViewObservations>& seen) {
    const std::vector<DrivingView> views = DrivingViewsOf(seen, cloth_.rig());
    const Stopwatch watch;
    const DrivenFrame frame = *driver_.Drive(33'000'000LL * ++moment_, views);
    if (moment_ <= kSettling) return;
    all_ms_.push_back(watch.Ms());
    for (const StageTime& stage : frame.times) stages_ms_[stage.name].push_back(stage.time_ms);
    lost_ += frame.lost ? 1 : 0;
    const std::vector<Eigen::Vector3d>& truth = cloth_.truth(moment_ - 1);
    double sum = 0;
    for (size_t v = 0; v < truth.size(); ++v) sum += (frame.mesh.vertices_mm[v] - truth[v]).norm();
    errors_mm_.push_back(sum / static_cast<double>(truth.size()));
  }
  int moment() const { return moment_; }

  void Report(benchmark::State& state) const {
    for (const auto& [name, ms] : stages_ms_) state.counters[name + "_ms"] = Median(ms);
    state.counters["drive_ms"] = Median(all_ms_);
    state.counters["ratio"] = Median(all_ms_) / ReferenceMs();
    state.counters["error_mm"] = Median(errors_mm_);
    state.counters["lost"] = lost_;
    state.counters["vertices"] = static_cast<double>(cloth_.garment().rest.vertices_mm.size());
  }

 private:
  static constexpr int kSettling = 3;  // the first frame looks for the garment
  const testing::WavingCloth& cloth_;
  SparseViewDriver driver_;
  int moment_ = 0, lost_ = 0;
  std::vector<double> all_ms_, errors_mm_;
  std::map<std::string, std::vector<double>> stages_ms_;
};

void Baseline(benchmark::State& state) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Random(kSide, kSide), out(kSide, kSide);
  for (auto _ : state) Multiply(a, out);
}
BENCHMARK(Baseline)->Unit(benchmark::kMillisecond);

// The elastic solver alone: the mesh at rest drawn to where it is, by all vertices.
void PlainElastic(benchmark::State& state) {
  const testing::WavingCloth& cloth = ClothOf(static_cast<int>(state.range(0)));
  const AlignmentModel model(cloth.garment());
  ElasticProblem problem;
  problem.targets_mm = cloth.truth(3);
  problem.weights.assign(problem.targets_mm.size(), Eigen::Matrix3d::Identity());
  tbb::task_arena(1).execute([&] {
    for (auto _ : state) {
      Deformation mesh{model.rest().vertices_mm, {}};
      mesh.rotation.assign(mesh.position_mm.size(), Eigen::Matrix3d::Identity());
      benchmark::DoNotOptimize(SolveElastic(model.slices(), model.graph(), problem, {}, &mesh));
    }
  });
}
BENCHMARK(PlainElastic)->Arg(71)->Arg(141)->ArgName("n")->Unit(benchmark::kMillisecond);

// Without decoding.
void DriveObservations(benchmark::State& state) {
  const testing::WavingCloth& cloth = ClothOf(static_cast<int>(state.range(0)));
  Drive drive(cloth);
  tbb::task_arena(static_cast<int>(state.range(1))).execute([&] {
    for (int k = 0; k < 3; ++k) drive.Next(cloth.observations(drive.moment()));
    for (auto _ : state) drive.Next(cloth.observations(drive.moment()));
  });
  drive.Report(state);
}
BENCHMARK(DriveObservations)
    ->ArgsProduct({{71, 141}, {1, 2}})
    ->ArgNames({"n", "threads"})
    ->Iterations(60)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// With decoding of two pictures of 1.3 megapixels, the next frame's while one is driven, as `weft avatar
// drive` does it.
void DrivePictures(benchmark::State& state) {
  const testing::WavingCloth& cloth = ClothOf(static_cast<int>(state.range(0)));
  const BoardIndex board = *BoardIndex::Build(cloth.board());
  std::vector<std::array<Frame, 2>> pictures;
  for (int k = 0; k < testing::WavingCloth::kMoments; ++k) pictures.push_back(cloth.Film(k));
  Drive drive(cloth);
  std::vector<double> decode_ms;
  const auto decode = [&](int moment) {
    const Stopwatch watch;
    const int at = moment % (2 * testing::WavingCloth::kMoments - 2);
    const auto& frames =
        pictures[static_cast<size_t>(std::min(at, 2 * testing::WavingCloth::kMoments - 2 - at))];
    std::vector<ViewObservations> out(2);
    tbb::parallel_for(0, 2, [&](int c) {
      const auto view = static_cast<size_t>(c);
      out[view] = {c, DecodeView(frames[view], board, {})->observations};
    });
    decode_ms.push_back(watch.Ms());
    return out;
  };
  tbb::task_arena(static_cast<int>(state.range(1))).execute([&] {
    std::vector<ViewObservations> seen = decode(0), next;
    const auto step = [&] {
      const int following = drive.moment() + 1;
      tbb::parallel_invoke([&] { next = decode(following); }, [&] { drive.Next(seen); });
      seen = std::move(next);
    };
    for (int k = 0; k < 3; ++k) step();
    for (auto _ : state) step();
  });
  drive.Report(state);
  state.counters["decode_ms"] = Median(decode_ms);
  state.counters["megapixels"] = 1e-6 * cloth.rig().cameras[0].width_px * cloth.rig().cameras[0].height_px;
}
BENCHMARK(DrivePictures)
    ->ArgsProduct({{71, 141}, {1, 2}})
    ->ArgNames({"n", "threads"})
    ->Iterations(60)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
