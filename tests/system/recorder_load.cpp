// Runs the recorder on simulated cameras for tests that kill it and take its disk away.
//   recorder_load record FOLDER CAMERAS WIDTH_PX HEIGHT_PX SETS FPS QUEUE_MIB   FPS 0: as fast as it takes
//   them
// prints "ack N" for each set that is acknowledged, at the end its counters and, on failure, the error.
//   recorder_load check FOLDER CAMERAS WIDTH_PX HEIGHT_PX [LAST]
// prints how many sets there are and the last one; fails where any byte is not as it was recorded. Frames may
// be missing, with a reason, in sets after LAST alone; without it, in none.
//   recorder_load recover FOLDER CAMERAS WIDTH_PX HEIGHT_PX [LAST]
// recovers the take, verifies it, and checks it in the same way; prints how many sets the index had not
// known.
//   recorder_load intact FOLDER CAMERAS WIDTH_PX HEIGHT_PX
// prints a line for every frame, "CAMERA SET exact" or "CAMERA SET missing REASON"; fails where the bytes are
// others.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "capture/take/recorded_take.h"
#include "services/studio/recording/recorder.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_recovery.h"
#include "tests/capture/pattern_frames.h"

namespace {

using weft::PatternFrames;

std::vector<std::string> Ids(int cameras) {
  std::vector<std::string> ids;
  for (int i = 0; i < cameras; ++i) ids.push_back("cam" + std::to_string(100 + i));
  return ids;
}

int Record(const std::string& folder, PatternFrames& cameras, uint64_t sets, double fps, uint64_t queue_mib) {
  weft::RecorderOptions options;
  options.queue_bytes = queue_mib << 20;
  options.flush_interval_ms = 10;
  options.low_disk_bytes = 0;
  options.slow_write_ms = 200;
  options.stop_timeout_ms = 1500;
  options.take.stream.preallocate_bytes = 1 << 20;
  weft::v1::Take take = weft::NewTake("");
  for (const std::string& id : cameras.camera_ids()) take.add_cameras()->set_id(id);
  weft::DescribeStreams(take, options.take);
  const auto recorder = weft::Recorder::Start(folder, cameras.camera_ids(), options, [](uint64_t set) {
    const std::string line = "ack " + std::to_string(set) + "\n";
    if (write(STDOUT_FILENO, line.data(), line.size()) < 0) std::abort();
  });
  if (!recorder.ok()) {
    std::fprintf(stderr, "%s\n", recorder.status().ToString().c_str());
    return 2;
  }
  if (const absl::Status written = weft::WriteTakeFile(folder, take); !written.ok()) {
    std::fprintf(stderr, "%s\n", written.ToString().c_str());
    _exit(2);
  }
  auto due = std::chrono::steady_clock::now();
  for (uint64_t set = 0; set < sets; ++set) {
    if (fps > 0) {
      due += std::chrono::nanoseconds(static_cast<int64_t>(1e9 / fps));
      std::this_thread::sleep_until(due);
      (*recorder)->Offer(cameras.Set(set));
    } else if (!(*recorder)->OfferAndWait(cameras.Set(set))) {
      break;
    }
  }
  absl::Status status = (*recorder)->Stop();
  const weft::RecorderCounters counters = (*recorder)->Counters();
  weft::SetOutcome(counters, take);
  if (!absl::IsDeadlineExceeded(status)) status.Update(weft::WriteTakeFile(folder, take));
  std::printf("offered %llu recorded %llu dropped %llu peak_mib %llu cause %s\n",
              static_cast<unsigned long long>(counters.sets_offered),
              static_cast<unsigned long long>(counters.sets_recorded),
              static_cast<unsigned long long>(counters.sets_dropped),
              static_cast<unsigned long long>(counters.queued_bytes_peak >> 20), counters.stop_cause.c_str());
  std::fflush(stdout);
  if (!status.ok()) std::fprintf(stderr, "%s\n", status.ToString().c_str());
  _exit(status.ok() ? 0 : 1);  // threads may still wait for the disk
}

// `last`: of the sets in which no frame may be missing.
int Check(const std::string& folder, const PatternFrames& cameras, int64_t last) {
  const auto take = weft::RecordedTake::Open(folder);
  if (!take.ok()) {
    std::fprintf(stderr, "%s\n", take.status().ToString().c_str());
    return 1;
  }
  for (size_t i = 0; i < (*take)->sets().size(); ++i)
    for (size_t camera = 0; camera < cameras.camera_ids().size(); ++camera) {
      const uint64_t set = (*take)->sets()[i];
      const auto frame = (*take)->ReadRaw(i, camera);
      if (frame.ok() && cameras.IsExact(*frame, camera, set)) continue;
      if (absl::IsNotFound(frame.status()) && static_cast<int64_t>(set) > last) continue;
      std::fprintf(stderr, "set %llu of camera %zu: %s\n", static_cast<unsigned long long>(set), camera,
                   frame.ok() ? "other bytes" : frame.status().ToString().c_str());
      return 1;
    }
  const auto& sets = (*take)->sets();
  std::printf("sets %zu last %lld\n", sets.size(), sets.empty() ? -1LL : static_cast<long long>(sets.back()));
  return 0;
}

int Recover(const std::string& folder, const PatternFrames& cameras, int64_t last) {
  const auto recovery = weft::RecoverRecordedTake(folder);
  if (!recovery.ok() || recovery->frames_lost() > 0) {
    std::fprintf(stderr, "%s\n",
                 recovery.ok() ? recovery->ShortDebugString().c_str() : recovery.status().ToString().c_str());
    return 1;
  }
  const auto check = weft::VerifyRecordedTake(folder);
  if (!check.ok() || !check->whole()) {
    std::fprintf(stderr, "%s\n",
                 check.ok() ? check->ShortDebugString().c_str() : check.status().ToString().c_str());
    return 1;
  }
  std::printf("brought_back %llu\n", static_cast<unsigned long long>(recovery->brought_back()));
  return Check(folder, cameras, last);
}

int Intact(const std::string& folder, const PatternFrames& cameras) {
  const auto take = weft::RecordedTake::Open(folder);
  if (!take.ok()) {
    std::fprintf(stderr, "%s\n", take.status().ToString().c_str());
    return 1;
  }
  int result = 0;
  for (size_t camera = 0; camera < (*take)->camera_ids().size(); ++camera)
    for (size_t i = 0; i < (*take)->sets().size(); ++i) {
      const auto frame = (*take)->ReadRaw(i, camera);
      const bool is_exact = frame.ok() && cameras.IsExact(*frame, camera, (*take)->sets()[i]);
      if (frame.ok() && !is_exact) result = 1;
      std::printf("%s %llu %s\n", (*take)->camera_ids()[camera].c_str(),
                  static_cast<unsigned long long>((*take)->sets()[i]),
                  is_exact     ? "exact"
                  : frame.ok() ? "other"
                               : ("missing " + std::string(frame.status().message())).c_str());
    }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (argc < 6) return 2;
  PatternFrames cameras(Ids(std::atoi(argv[3])), std::atoi(argv[4]), std::atoi(argv[5]));
  if (what == "record" && argc == 9) {
    return Record(argv[2], cameras, std::strtoull(argv[6], nullptr, 10), std::atof(argv[7]),
                  std::strtoull(argv[8], nullptr, 10));
  }
  const int64_t last = argc > 6 ? std::atoll(argv[6]) : INT64_MAX;
  if (what == "recover") return Recover(argv[2], cameras, last);
  if (what == "intact") return Intact(argv[2], cameras);
  return what == "check" ? Check(argv[2], cameras, last) : 2;
}
