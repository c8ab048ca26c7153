#include "services/plan/pilot.h"

#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "base/stopwatch.h"
#include "services/pipeline/registration.h"
#include "services/pipeline/registration_inputs.h"

namespace weft {
namespace {

constexpr double kMib = 1 << 20;

// What this process has taken so far.
struct Taken {
  double core_s = 0, read_mib = 0, written_mib = 0, peak_mib = 0;
};

double SecondsOf(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
}

Taken TakenSoFar() {
  constexpr double kKibPerMib = 1024;
  Taken taken;
  rusage used = {};
  if (getrusage(RUSAGE_SELF, &used) == 0) {
    taken.core_s = SecondsOf(used.ru_utime) + SecondsOf(used.ru_stime);
    taken.peak_mib = static_cast<double>(used.ru_maxrss) / kKibPerMib;
  }
  std::ifstream file("/proc/self/io");
  std::string name;
  for (double bytes = 0; file >> name >> bytes;) {
    if (name == "rchar:") taken.read_mib = bytes / kMib;
    if (name == "wchar:") taken.written_mib = bytes / kMib;
  }
  return taken;
}

}  // namespace

std::vector<size_t> PilotFrames(size_t all, size_t wanted) {
  constexpr size_t kRuns = 4, kLeastOfRun = 3;
  wanted = std::min(wanted, all);
  const size_t runs = std::clamp<size_t>(wanted / kLeastOfRun, 1, kRuns);
  std::vector<size_t> positions;
  for (size_t run = 0; run < runs && wanted > 0; ++run) {
    const size_t length = wanted * (run + 1) / runs - wanted * run / runs;
    // Even gaps before, between and after the runs.
    size_t begin = (all - wanted) * (2 * run + 1) / (2 * runs) + wanted * run / runs;
    for (size_t i = 0; i < length; ++i) positions.push_back(begin++);
  }
  return positions;
}

absl::StatusOr<Pilot> RunPilot(const v1::RegistrationSpec& spec, const PilotOptions& options,
                               std::stop_token stop) {
  Pilot pilot;
  pilot.threads = options.threads;
  const Taken before = TakenSoFar();
  const Stopwatch loading;
  const absl::StatusOr<std::unique_ptr<RegistrationInputs>> inputs = LoadInputs(spec);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<std::vector<size_t>> all = FramesInRange(spec, (*inputs)->dump->frame_names());
  if (!all.ok()) return all.status();
  pilot.startup_s = loading.Seconds();
  pilot.job_frames = static_cast<int>(all->size());
  std::vector<size_t> frames;
  for (const size_t position : PilotFrames(all->size(), static_cast<size_t>(std::max(1, options.frames))))
    frames.push_back((*all)[position]);

  const Taken loaded = TakenSoFar();
  pilot.startup_core_s = loaded.core_s - before.core_s;
  RegistrationEvents events;
  Stopwatch frame;
  events.finished = [&](const v1::FrameInfo&) {
    pilot.frame_s.push_back(frame.Seconds());
    frame = Stopwatch();
    options.progress(pilot.frame_s.size(), frames.size());
  };
  if (absl::Status status = RegisterFrames(**inputs, frames, frames, spec.options(), options.out,
                                           {.threads = options.threads}, events, std::move(stop));
      !status.ok()) {
    return status;
  }
  const Taken done = TakenSoFar();
  const auto count = static_cast<double>(frames.size());
  pilot.frame_core_s = (done.core_s - loaded.core_s) / count;
  pilot.mib_read_per_frame = (done.read_mib - loaded.read_mib) / count;
  pilot.mib_written_per_frame = (done.written_mib - loaded.written_mib) / count;
  pilot.peak_memory_mib = done.peak_mib;
  return pilot;
}

}  // namespace weft
