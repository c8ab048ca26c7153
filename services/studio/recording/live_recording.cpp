#include "services/studio/recording/live_recording.h"

#include <chrono>
#include <filesystem>
#include <map>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_words.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPollInterval{50};
constexpr std::chrono::seconds kClockWait{3};

// What the threads of the cameras share.
class SetsToRecorder {
 public:
  SetsToRecorder(const std::vector<std::string>& ids, const LiveRecordingOptions& options, Recorder& recorder,
                 ClockLog& clocks)
      : ids_(ids),
        options_(options),
        assembler_(ids, options.sets),
        recorder_(recorder),
        clocks_(clocks),
        cameras_(ids.size()) {}

  // True where the camera's clock had better be read now.
  bool Add(size_t camera, CameraDelivery delivery) {
    const MutexLock lock(mutex_);
    if (delivery.kind == CameraDelivery::Kind::kClock) {
      const std::string change = clocks_.Add(camera, delivery.clock);
      if (!change.empty()) recorder_.Note(ids_[camera], change);
    }
    const bool is_reading = delivery.kind == CameraDelivery::Kind::kClock;
    Count(delivery.kind, cameras_[camera]);
    Hand(assembler_.Add(camera, std::move(delivery), HostTime_ns()));
    if (is_reading && !assembler_.IsClockReadable(camera)) clocks_.Distrust(camera);
    return assembler_.WantsReading(camera);
  }
  void Advance() {
    const MutexLock lock(mutex_);
    Hand(assembler_.Advance(HostTime_ns()));
  }
  bool IsWaiting(int64_t before_host_ns) {
    const MutexLock lock(mutex_);
    return assembler_.IsWaiting(before_host_ns);
  }
  void Finish(int64_t end_host_ns) {
    const MutexLock lock(mutex_);
    Hand(assembler_.Finish(HostTime_ns(), end_host_ns));
  }
  // Without the receivers' counters.
  std::vector<LiveCameraState> Cameras() {
    const MutexLock lock(mutex_);
    return cameras_;
  }

 private:
  static void Count(CameraDelivery::Kind kind, LiveCameraState& camera) {
    using Kind = CameraDelivery::Kind;
    camera.disconnections += kind == Kind::kDisconnected;
    camera.reconnections += kind == Kind::kReconnected;
    if (kind == Kind::kDisconnected || kind == Kind::kSilent) camera.is_away = true;
    if (kind == Kind::kFrame || kind == Kind::kReconnected || kind == Kind::kAnswers) camera.is_away = false;
  }
  void Hand(AssembledSets out) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    for (const auto& [camera, frames] : out.lost) cameras_[camera].frames_lost += frames;
    for (const LedgerEntry& entry : out.entries) {
      if (entry.event == LedgerEvent::kDropped) {
        recorder_.NoteDropped(entry.first_set, entry.last_set, entry.device_time_ns, entry.cause);
      } else {
        recorder_.Note(entry.camera_id, entry.cause);
      }
    }
    for (RawFrameSet& set : out.sets) {
      if (options_.look && recorder_.Counters().queued_bytes < options_.recorder.queue_bytes / 2)
        options_.look(set);
      recorder_.Offer(std::move(set));
    }
  }

  const std::vector<std::string> ids_;
  const LiveRecordingOptions& options_;
  Mutex mutex_;
  FrameSetAssembler assembler_ ABSL_GUARDED_BY(mutex_);
  Recorder& recorder_;
  ClockLog& clocks_;
  std::vector<LiveCameraState> cameras_ ABSL_GUARDED_BY(mutex_);
};

void Pump(CameraSource& camera, size_t index, const std::atomic<bool>& stopping, std::atomic<size_t>& running,
          SetsToRecorder& sets) {
  while (!stopping) {
    absl::StatusOr<CameraDelivery> delivery = camera.Next(kPollInterval);
    if (delivery.ok()) {
      if (sets.Add(index, *std::move(delivery))) camera.AskForClock();
    } else if (!absl::IsDeadlineExceeded(delivery.status())) {
      CameraDelivery end;
      end.kind = absl::IsOutOfRange(delivery.status()) ? CameraDelivery::Kind::kEnded
                                                       : CameraDelivery::Kind::kDisconnected;
      end.cause = std::string(delivery.status().message());
      sets.Add(index, std::move(end));
      break;
    }
  }
  --running;
}

const char* TriggerInWords(TriggerKind kind) {
  switch (kind) {
    case TriggerKind::kFreeRun:
      return "free run";
    case TriggerKind::kSoftware:
      return "software trigger";
    case TriggerKind::kLine:
      return "hardware trigger";
    case TriggerKind::kAction:
      return "action commands";
  }
  return "";
}

v1::Take Describe(const std::vector<std::unique_ptr<CameraSource>>& cameras,
                  const LiveRecordingOptions& options) {
  v1::Take take = NewTake("");
  const FrameSetOptions& sets = options.sets;
  take.set_sync(absl::StrFormat("%s, %s, tolerance %.3f ms", TriggerInWords(options.trigger.kind),
                                sets.clocks == ClockDomain::kShared ? "shared clocks" : "clocks of their own",
                                static_cast<double>(sets.tolerance_ns) / 1e6));
  take.set_own_clocks(sets.clocks == ClockDomain::kEstimated);
  if (sets.period_ns > 0)
    *take.mutable_sync() += absl::StrFormat(", period %.3f ms", static_cast<double>(sets.period_ns) / 1e6);
  for (const auto& source : cameras) {
    v1::TakeCamera& camera = *take.add_cameras();
    camera.set_id(source->camera_id());
    for (const auto& [name, value] : source->settings()) {
      if (name == "DeviceModelName") camera.set_model(value);
      if (name == "DeviceSerialNumber") camera.set_serial(value);
      (*camera.mutable_settings())[name] = value;
    }
    const size_t index = static_cast<size_t>(take.cameras_size()) - 1;
    camera.set_clock_problem(source->ClockProblem());
    camera.set_own_clock(sets.cameras[index].own_clock);
    camera.set_unsynchronized(sets.cameras[index].unsynchronized);
  }
  return take;
}

// Side by side: one that has just gone takes seconds.
void StopAll(const std::vector<std::unique_ptr<CameraSource>>& cameras) {
  std::vector<std::thread> threads;
  for (const auto& camera : cameras) threads.emplace_back([&camera] { camera->Stop(); });
  for (std::thread& thread : threads) thread.join();
}

bool FollowsPtp(const CameraSource& camera) {
  const std::string status = camera.settings()["PtpStatus"];
  return absl::StartsWithIgnoreCase(status, "slave") || absl::EqualsIgnoreCase(status, "master");
}

// A camera whose clock cannot be read is put onto the time of the others by the arrival of its frames, unless
// PTP vouches for its times. One entry per camera.
FrameSetOptions WithArrivalTimes(const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                 FrameSetOptions sets) {
  sets.cameras.resize(cameras.size());
  bool has_shared_clock = false;
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (!cameras[i]->ClockProblem().empty() && !FollowsPtp(*cameras[i])) sets.cameras[i].own_clock = true;
    has_shared_clock = has_shared_clock || !sets.cameras[i].own_clock;
  }
  if (!has_shared_clock) sets.clocks = ClockDomain::kEstimated;
  return sets;
}

// All, or none.
absl::Status StartAll(const std::vector<std::unique_ptr<CameraSource>>& cameras) {
  for (const auto& camera : cameras) WEFT_RETURN_IF_ERROR(camera->Prepare());
  for (const auto& camera : cameras) {
    if (absl::Status status = camera->Start(); !status.ok()) {
      StopAll(cameras);
      return status;
    }
  }
  return absl::OkStatus();
}

// What runs while a take is recorded.
class LiveTake {
 public:
  LiveTake(const std::vector<std::unique_ptr<CameraSource>>& cameras, const std::vector<std::string>& ids,
           const LiveRecordingOptions& options, Recorder& recorder, ClockLog& clocks)
      : cameras_(cameras),
        ids_(ids),
        options_(options),
        recorder_(recorder),
        clocks_(clocks),
        sets_(ids, options, recorder, clocks),
        running_(cameras.size()) {}

  absl::Status Begin() {
    for (size_t i = 0; i < cameras_.size(); ++i)
      threads_.emplace_back([this, i] { Pump(*cameras_[i], i, stopping_, running_, sets_); });
    if (!options_.trigger.IsOurs()) return absl::OkStatus();
    WaitForClocks();
    WEFT_ASSIGN_OR_RETURN(
        triggers_, TriggerSender::Start(
                       cameras_, options_.trigger, clocks_, [this](size_t camera, const std::string& what) {
                         recorder_.Note(ids_[camera], absl::StrCat("trigger not sent: ", what));
                       }));
    return absl::OkStatus();
  }

  void RunUntilTheEnd(const std::atomic<bool>& stop,
                      const std::function<void(const LiveRecordingState&)>& report) {
    const Stopwatch watch;
    for (bool is_over = false; !is_over;) {
      std::this_thread::sleep_for(kPollInterval);
      sets_.Advance();
      LiveRecordingState state;
      state.elapsed_s = watch.Seconds();
      state.recorder = recorder_.Counters();
      state.cameras = Cameras();
      if (report) report(state);
      is_over = stop || running_ == 0 || !state.recorder.stop_cause.empty() ||
                (options_.seconds > 0 && state.elapsed_s >= options_.seconds);
    }
  }

  std::vector<LiveCameraState> Cameras() {
    std::vector<LiveCameraState> states = sets_.Cameras();
    for (size_t i = 0; i < states.size(); ++i) states[i].receiver = cameras_[i]->counters();
    return states;
  }

  // No more triggers; what was triggered before still arrives.
  void End() {
    triggers_.reset();
    const int64_t end_ns = HostTime_ns();
    while (sets_.IsWaiting(end_ns) && recorder_.Counters().stop_cause.empty() &&
           HostTime_ns() - end_ns < options_.sets.max_wait_ns) {
      std::this_thread::sleep_for(kPollInterval / 5);
      sets_.Advance();
    }
    stopping_ = true;
    for (std::thread& thread : threads_) thread.join();
    StopAll(cameras_);
    sets_.Finish(end_ns);
  }

 private:
  // Action commands name a time of the cameras' clocks.
  void WaitForClocks() {
    const auto end = Clock::now() + kClockWait;
    for (size_t i = 0; i < cameras_.size(); ++i)
      while (options_.trigger.kind == TriggerKind::kAction && cameras_[i]->TakesTriggers() &&
             cameras_[i]->ClockProblem().empty() && !clocks_.Last(i) && Clock::now() < end)
        std::this_thread::sleep_for(kPollInterval / 5);
  }

  const std::vector<std::unique_ptr<CameraSource>>& cameras_;
  const std::vector<std::string>& ids_;
  const LiveRecordingOptions& options_;
  Recorder& recorder_;
  ClockLog& clocks_;
  SetsToRecorder sets_;
  std::atomic<bool> stopping_ = false;
  std::atomic<size_t> running_;
  std::vector<std::thread> threads_;
  std::unique_ptr<TriggerSender> triggers_;
};

void Summarize(const std::vector<LiveCameraState>& cameras, const RecorderCounters& counters,
               v1::Take& take) {
  SetOutcome(counters, take);
  for (size_t i = 0; i < cameras.size(); ++i)
    cameras[i].DescribeTo(*take.mutable_cameras(static_cast<int>(i)));
}

}  // namespace

std::vector<std::string> ClockWarnings(const std::vector<std::unique_ptr<CameraSource>>& cameras) {
  std::map<std::string, std::vector<std::string>> ids;  // by problem
  for (const auto& camera : cameras)
    if (const std::string problem = camera->ClockProblem(); !problem.empty())
      ids[problem].push_back(camera->camera_id());
  std::vector<std::string> warnings;
  for (const auto& [problem, with] : ids)
    warnings.push_back(absl::StrCat(
        with.size() == 1 ? absl::StrCat("camera ", with[0], ": its clock")
                         : absl::StrCat(with.size(), " of ", cameras.size(), " cameras (", NamesInShort(with),
                                        "): their clocks"),
        " cannot be read, ", problem, "; the arrival of frames stands in for ",
        with.size() == 1 ? "it" : "them", ": sets are as good as the network is even; PTP makes them exact"));
  return warnings;
}

namespace {

// A take that would end at once says so before a camera starts.
absl::Status CheckRoom(const std::string& folder, uint64_t mark_bytes) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path there = fs::absolute(folder, error);
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  const uint64_t free_bytes = fs::space(there, error).available;
  if (error || mark_bytes == 0 || free_bytes >= mark_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(folder, ": ", free_bytes >> 20, " MiB are free, and a take ends at the mark of ",
                   mark_bytes >> 20, " MiB; make room, or lower low_disk_gib in the session"));
}

}  // namespace

absl::StatusOr<v1::Take> RecordLive(const std::string& folder,
                                    const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                    const LiveRecordingOptions& given, const std::atomic<bool>& stop,
                                    const std::function<void(const LiveRecordingState&)>& report) {
  WEFT_RETURN_IF_ERROR(given.sets.Validate());
  WEFT_RETURN_IF_ERROR(given.trigger.Validate());
  WEFT_RETURN_IF_ERROR(CheckRoom(folder, given.recorder.low_disk_bytes));
  WEFT_RETURN_IF_ERROR(StartAll(cameras));
  LiveRecordingOptions options = given;
  options.sets = WithArrivalTimes(cameras, given.sets);
  options.trigger.clocks = options.sets.clocks;
  v1::Take take = Describe(cameras, options);
  std::vector<std::string> ids;
  for (const auto& camera : cameras) ids.push_back(camera->camera_id());
  RecorderOptions recorder_options = options.recorder;
  DescribeStreams(take, recorder_options.take);
  const auto recorder = Recorder::Start(folder, ids, recorder_options);
  ClockLog clocks(ids);
  absl::Status ready = recorder.status();
  if (ready.ok()) ready = WriteTakeFile(folder, take);
  if (ready.ok()) ready = clocks.Open(folder);
  if (!ready.ok()) {
    StopAll(cameras);
    return ready;
  }

  for (size_t i = 0; i < cameras.size(); ++i)
    if (const std::string problem = cameras[i]->ClockProblem(); !problem.empty())
      (*recorder)->Note(ids[i], absl::StrCat("its clock cannot be read: ", problem,
                                             "; the arrival times of its frames are used instead"));
  LiveTake live(cameras, ids, options, **recorder, clocks);
  absl::Status status = live.Begin();
  if (status.ok()) live.RunUntilTheEnd(stop, report);
  live.End();
  const absl::Status written = (*recorder)->Stop();
  status.Update(written);
  Summarize(live.Cameras(), (*recorder)->Counters(), take);
  if (!absl::IsDeadlineExceeded(written)) {
    status.Update(clocks.Close());
    take.set_clocks_checksum(clocks.end_checksum());
    status.Update(WriteTakeFile(folder, take));
  }
  if (!status.ok()) return status;
  return take;
}

}  // namespace weft
