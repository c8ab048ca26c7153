// How well scans with outliers fill hidden cloth, by the two numbers of `weft-pcl filter`; neighbours 0: no
// filter. Counters: the mean error of hidden vertices, and the shares of outliers and of good points that
// are removed. Data: a wrinkled sheet of 80 x 80 vertices (wrinkled_sheet.h), a quarter of it hidden, a
// scan of a point per mm^2 with noise of 0.5 mm, of which some points lie up to 30 mm off.
#include <benchmark/benchmark.h>

#include <map>

#include "alignment/align.h"
#include "services/formats/pcd/pcl_filter.h"
#include "tests/benchmark/wrinkled_sheet.h"

namespace weft {
namespace {

constexpr int kSize = 80;
constexpr double kStepMm = 1, kNoiseMm = 0.5, kFarMm = 30;

const testing::MeasuredSheet& Sheet() {
  static const testing::MeasuredSheet sheet = testing::WrinkledSheet(kSize);
  return sheet;
}

// With the columns x, y, z and `off`: 1 for outliers.
Ply ScanOf(int outlier_percent) {
  const double edge_mm = (kSize - 1) * testing::kCellMm;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, kNoiseMm);
  std::uniform_real_distribution<double> far(-kFarMm, kFarMm), percent(0, 100);
  std::vector<double> columns[4];
  for (double x = 0; x < edge_mm; x += kStepMm) {
    for (double y = 0; y < edge_mm; y += kStepMm) {
      const bool off = percent(random) < outlier_percent;
      const Eigen::Vector3d error(noise(random), noise(random), noise(random));
      const Eigen::Vector3d aside(far(random), far(random), far(random));
      const Eigen::Vector3d point = testing::Wrinkled({x, y, 0}) + (off ? aside : error);
      for (int i = 0; i < 3; ++i) columns[i].push_back(point[i]);
      columns[3].push_back(off ? 1 : 0);
    }
  }
  PlyElement vertex;
  vertex.name = "vertex";
  vertex.rows = columns[0].size();
  const char* names[] = {"x", "y", "z", "off"};
  for (int i = 0; i < 4; ++i)
    vertex.properties.push_back(PlyColumn(names[i], PlyType::kFloat32, std::move(columns[i])));
  Ply ply;
  ply.elements.push_back(std::move(vertex));
  return ply;
}

double Outliers(const PlyElement& vertex) {
  double sum = 0;
  for (const double off : vertex.Find("off")->values) sum += off;
  return sum;
}

double HiddenErrorMm(const Scan* scan) {
  const AlignmentModel model(Sheet().garment);
  const auto aligned = Align(model, Sheet().targets, AlignOptions{}, {.scan = scan});
  return testing::MeanError(aligned.value().mesh.vertices_mm, Sheet().truth,
                            [](int v) { return testing::InHiddenPatch(v, kSize); });
}

void FilteredScan(benchmark::State& state) {
  const Ply whole = ScanOf(static_cast<int>(state.range(0)));
  const OutlierOptions options = {static_cast<int>(state.range(1)),
                                  0.1 * static_cast<double>(state.range(2))};
  Ply kept = whole;
  for (auto _ : state) {
    if (options.neighbors > 0) kept = WithoutOutliers(whole, options).value();
  }
  const PlyElement &before = whole.elements[0], &after = kept.elements[0];
  Scan scan;
  for (size_t i = 0; i < after.rows; ++i) {
    const auto at = [&](const char* axis) { return after.Find(axis)->values[i]; };
    scan.points_mm.emplace_back(at("x"), at("y"), at("z"));
  }
  const double off = Outliers(before), good = static_cast<double>(before.rows) - off;
  state.counters["hidden_mm"] = HiddenErrorMm(&scan);
  if (off > 0) state.counters["outliers_removed"] = 1 - Outliers(after) / off;
  state.counters["good_removed"] = 1 - (static_cast<double>(after.rows) - Outliers(after)) / good;
}
BENCHMARK(FilteredScan)
    ->ArgNames({"outlier_percent", "neighbors", "sigmas_x10"})
    ->ArgsProduct({{0, 10, 30}, {0}, {0}})
    ->ArgsProduct({{0, 10, 30}, {3, 6, 12, 24}, {0, 2, 5, 10}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

void NoScan(benchmark::State& state) {
  for (auto _ : state) state.counters["hidden_mm"] = HiddenErrorMm(nullptr);
}
BENCHMARK(NoScan)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
