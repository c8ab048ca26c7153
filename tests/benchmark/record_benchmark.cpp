// How fast simulated cameras of 2668x4096 are recorded, against what the disk takes in the same run. The disk
// is that of the folder in WEFT_BENCHMARK_DIR, else of the working directory.
#include <benchmark/benchmark.h>
#include <stdlib.h>

#include <filesystem>

#include "base/stopwatch.h"
#include "services/studio/recording/disk_speed.h"
#include "services/studio/recording/recorder.h"
#include "tests/capture/pattern_frames.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
constexpr uint64_t kSets = 60;
constexpr size_t kCameras = 4;

std::string Folder() {
  const char* folder = getenv("WEFT_BENCHMARK_DIR");
  return ((folder ? fs::path(folder) : fs::current_path()) / "weft_record_benchmark").string();
}

PatternFrames& Cameras() {
  static PatternFrames cameras({"a", "b", "c", "d"}, 2668, 4096);
  return cameras;
}

// The baseline: whole frames to one preallocated file, flushed at the end.
void Disk(benchmark::State& state) {
  fs::create_directories(Folder());
  double rate = 0;
  for (auto _ : state) {
    const auto speed = MeasureDiskSpeed(Folder(), uint64_t{2} << 30);
    if (!speed.ok()) return state.SkipWithError(std::string(speed.status().message()).c_str());
    state.SetIterationTime((uint64_t{2} << 30) / speed->bytes_per_s);
    rate = speed->bytes_per_s;
  }
  state.counters["GB/s"] = rate / 1e9;
  fs::remove_all(Folder());
}
BENCHMARK(Disk)->UseManualTime()->Iterations(1)->Repetitions(3)->Unit(benchmark::kMillisecond);

// Frame sets as fast as the recorder takes them, from the first offer to the last byte on the disk.
void Record(benchmark::State& state) {
  RecorderOptions options;
  options.writers = static_cast<int>(state.range(0));
  options.queue_bytes = uint64_t{512} << 20;
  options.low_disk_bytes = 0;
  options.take.stream.compress = state.range(1) != 0;
  std::vector<RawFrameSet> ready;
  for (uint64_t set = 0; set < 4; ++set) ready.push_back(Cameras().Set(set));
  double seconds = 0, bytes = 0;
  for (auto _ : state) {
    fs::remove_all(Folder());
    const auto recorder = Recorder::Start(Folder(), Cameras().camera_ids(), options);
    if (!recorder.ok()) return state.SkipWithError(std::string(recorder.status().message()).c_str());
    const Stopwatch watch;
    for (uint64_t set = 0; set < kSets; ++set) {
      RawFrameSet next = ready[set % ready.size()];
      next.number = set;
      (*recorder)->OfferAndWait(std::move(next));
    }
    const absl::Status status = (*recorder)->Stop();
    seconds = watch.Seconds();
    const RecorderCounters counters = (*recorder)->Counters();
    if (!status.ok() || counters.sets_recorded != kSets) return state.SkipWithError("sets are missing");
    state.SetIterationTime(seconds);
    bytes = static_cast<double>(kSets * kCameras) * 2668 * 4096;
    state.counters["queue_MiB"] = static_cast<double>(counters.queued_bytes_peak >> 20);
  }
  state.counters["GB/s"] = bytes / seconds / 1e9;
  fs::remove_all(Folder());
}
BENCHMARK(Record)
    ->ArgNames({"writers", "compress"})
    ->Args({1, 0})
    ->Args({2, 0})
    ->Args({4, 0})
    ->Args({2, 1})
    ->UseManualTime()
    ->Iterations(1)
    ->Repetitions(3)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace weft
