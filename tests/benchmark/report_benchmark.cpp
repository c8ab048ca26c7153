// The report of a job of 300 frames of 100,000 vertices: time of WriteJobReport, size of the page (goal: less
// than 40 MB), peak of memory. The result of 1.9 GB is made in WEFT_BENCHMARK_DIR, or the folder for
// temporary files, and removed, but for report.html where WEFT_BENCHMARK_DIR is set.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/report/job_report.h"
#include "tests/services/results/report/sample_job.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
constexpr int kRound = 316, kTall = 316;

std::vector<Face> TubeFaces() {
  std::vector<Face> faces;
  for (int i = 0; i + 1 < kTall; ++i) {
    for (int j = 0; j < kRound; ++j) {
      const int a = i * kRound + j, b = i * kRound + (j + 1) % kRound;
      faces.push_back({a, b, a + kRound});
      faces.push_back({b, b + kRound, a + kRound});
    }
  }
  return faces;
}

// A shirt's body that sways; wrinkles run over it, two patches are hidden, a third is seen by two cameras.
RegisteredMesh Tube(int frame) {
  const double t = 0.12 * frame;
  RegisteredMesh mesh;
  for (int i = 0; i < kTall; ++i) {
    for (int j = 0; j < kRound; ++j) {
      const double s = static_cast<double>(i) / kTall, a = -2 * M_PI * j / kRound + 0.2 * std::sin(t) * s;
      const double wrinkle =
          7 * s * std::sin(9 * a + 14 * s + t) + 3 * std::sin(40 * s + 3 * std::sin(4 * a) + 2 * t);
      const double radius = 1 + 0.12 * std::sin(3 * s) + wrinkle / 150;
      mesh.vertices_mm.emplace_back(190 * radius * std::cos(a) + 60 * std::sin(t) * (1 - s), 640 * s - 300,
                                    1200 + 120 * radius * std::sin(a));
      const double armpit = std::hypot(std::remainder(a - 0.2, M_PI) * 2, 3 * (s - 0.25) + 0.2 * std::sin(t));
      const bool hidden = armpit < 0.5 || (armpit < 0.65 && std::sin(31 * a + 47 * s) > 0);
      const bool two = !hidden && armpit < 0.8;
      mesh.state.push_back(frame % 97 == 50 ? VertexState::kBridged
                           : hidden         ? VertexState::kInferred
                           : two            ? VertexState::kTwoView
                                            : VertexState::kObserved);
      mesh.sigma_mm.push_back(static_cast<float>(hidden ? 2.5 : 0.05 + 0.06 * s + 0.1 * std::exp(-armpit)));
      mesh.views.push_back(hidden ? 0 : two ? 2 : 5);
    }
  }
  return mesh;
}

void WriteTheReport(benchmark::State& state) {
  const char* const given = std::getenv("WEFT_BENCHMARK_DIR");
  const fs::path out = (given ? fs::path(given) : fs::temp_directory_path()) / "weft report benchmark";
  const std::vector<Face> faces = TubeFaces();
  std::vector<v1::FrameReport> frames;
  for (int i = 0; i < state.range(0); ++i) {
    v1::FrameReport frame = SampleFrame(i);
    if (i % 97 == 50) {
      FailFrame("no cell could be triangulated", frame);
      frame.mutable_temporal()->set_bridged(true);
    }
    fs::create_directories(out / frame.frame());
    if (!WriteJsonFile((out / frame.frame() / "report.json").string(), frame).ok() ||
        !WriteRegisteredMesh((out / frame.frame() / "mesh.ply").string(), Tube(i), faces).ok())
      return state.SkipWithError("the disk is full");
    frames.push_back(std::move(frame));
  }
  const v1::Job job = SampleJob(frames);
  for (auto _ : state)
    if (!WriteJobReport(out.string(), job).ok()) return state.SkipWithError("no report");
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["page_MB"] = 1e-6 * static_cast<double>(fs::file_size(out / "report.html"));
  state.counters["peak_MiB"] = static_cast<double>(usage.ru_maxrss) / 1024;
  state.counters["vertices"] = kRound * kTall;
  if (given)
    fs::copy_file(out / "report.html", fs::path(given) / "report.html", fs::copy_options::overwrite_existing);
  fs::remove_all(out);
}
BENCHMARK(WriteTheReport)->Arg(20)->Arg(300)->ArgName("frames")->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
}  // namespace weft
