#include "services/recording/live_recording.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/recording/take_file.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPollInterval{50};

int64_t HostTime_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// What the threads of the cameras share.
class SetsToRecorder {
 public:
  SetsToRecorder(const std::vector<std::string>& ids, const FrameSetOptions& options, Recorder& recorder)
      : assembler_(ids, options), recorder_(recorder) {}

  void Add(size_t camera, CameraDelivery delivery) {
    const std::lock_guard lock(mutex_);
    Hand(assembler_.Add(camera, std::move(delivery), HostTime_ns()));
  }
  void Advance() {
    const std::lock_guard lock(mutex_);
    Hand(assembler_.Advance(HostTime_ns()));
  }
  void Finish() {
    const std::lock_guard lock(mutex_);
    Hand(assembler_.Finish(HostTime_ns()));
  }

 private:
  void Hand(AssembledSets out) {
    for (const LedgerEntry& entry : out.entries) {
      if (entry.event == LedgerEvent::kDropped) {
        recorder_.NoteDropped(entry.first_set, entry.last_set, entry.device_time_ns, entry.cause);
      } else {
        recorder_.Note(entry.camera_id, entry.cause);
      }
    }
    for (RawFrameSet& set : out.sets) recorder_.Offer(std::move(set));
  }

  std::mutex mutex_;
  FrameSetAssembler assembler_;
  Recorder& recorder_;
};

void Pump(CameraSource& camera, size_t index, const std::atomic<bool>& stopping, std::atomic<size_t>& running,
          SetsToRecorder& sets) {
  while (!stopping) {
    absl::StatusOr<CameraDelivery> delivery = camera.Next(kPollInterval);
    if (delivery.ok()) {
      sets.Add(index, *std::move(delivery));
    } else if (!absl::IsDeadlineExceeded(delivery.status())) {
      CameraDelivery end;
      end.kind = CameraDelivery::Kind::kDisconnected;
      end.cause = std::string(delivery.status().message());
      sets.Add(index, std::move(end));
      break;
    }
  }
  --running;
}

v1::Take Describe(const std::vector<std::unique_ptr<CameraSource>>& cameras) {
  v1::Take take = NewTake("");
  for (const auto& source : cameras) {
    v1::TakeCamera& camera = *take.add_cameras();
    camera.set_id(source->camera_id());
    for (const auto& [name, value] : source->settings()) {
      if (name == "DeviceModelName") camera.set_model(value);
      if (name == "DeviceSerialNumber") camera.set_serial(value);
      (*camera.mutable_settings())[name] = value;
    }
  }
  return take;
}

void StopAll(const std::vector<std::unique_ptr<CameraSource>>& cameras) {
  for (const auto& camera : cameras) camera->Stop();
}

// All, or none.
absl::Status StartAll(const std::vector<std::unique_ptr<CameraSource>>& cameras) {
  for (const auto& camera : cameras) {
    if (absl::Status status = camera->Start(); !status.ok()) {
      StopAll(cameras);
      return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<v1::Take> RecordLive(const std::string& folder,
                                    const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                    const LiveRecordingOptions& options, const std::atomic<bool>& stop,
                                    const std::function<void(const LiveRecordingState&)>& report) {
  if (absl::Status status = options.sets.Validate(); !status.ok()) return status;
  if (absl::Status status = StartAll(cameras); !status.ok()) return status;
  v1::Take take = Describe(cameras);
  std::vector<std::string> ids;
  for (const auto& camera : cameras) ids.push_back(camera->camera_id());
  RecorderOptions recorder_options = options.recorder;
  recorder_options.take.take = TakeNumber(take);
  const auto recorder = Recorder::Start(folder, ids, recorder_options);
  absl::Status ready = recorder.status();
  if (ready.ok()) ready = WriteTakeFile(folder, take);
  if (!ready.ok()) {
    StopAll(cameras);
    return ready;
  }

  SetsToRecorder sets(ids, options.sets, **recorder);
  std::atomic<bool> stopping = false;
  std::atomic<size_t> running = cameras.size();
  std::vector<std::thread> threads;
  for (size_t i = 0; i < cameras.size(); ++i)
    threads.emplace_back([&, i] { Pump(*cameras[i], i, stopping, running, sets); });
  const auto begin = Clock::now();
  while (!stopping) {
    std::this_thread::sleep_for(kPollInterval);
    sets.Advance();
    LiveRecordingState state;
    state.elapsed_s = std::chrono::duration<double>(Clock::now() - begin).count();
    state.recorder = (*recorder)->Counters();
    for (const auto& camera : cameras) state.cameras.push_back(camera->counters());
    if (report) report(state);
    stopping = stop || running == 0 || !state.recorder.stop_cause.empty() ||
               (options.seconds > 0 && state.elapsed_s >= options.seconds);
  }
  for (std::thread& thread : threads) thread.join();
  StopAll(cameras);
  sets.Finish();
  const absl::Status written = (*recorder)->Stop();
  const RecorderCounters counters = (*recorder)->Counters();
  take.set_state(counters.stop_cause.empty() ? v1::TAKE_STATE_COMPLETE : v1::TAKE_STATE_STOPPED);
  take.set_stop_cause(counters.stop_cause);
  take.set_ended_host_time_ns(HostTime_ns());
  take.set_sets_recorded(counters.sets_recorded);
  take.set_sets_dropped(counters.sets_dropped);
  take.set_frames_missing(counters.frames_missing);
  absl::Status status = written;
  if (!absl::IsDeadlineExceeded(written)) status.Update(WriteTakeFile(folder, take));
  if (!status.ok()) return status;
  return take;
}

}  // namespace weft
