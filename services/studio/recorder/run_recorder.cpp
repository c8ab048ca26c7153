#include "services/studio/recorder/run_recorder.h"

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/formats/files/json_file.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recording/disk_check.h"
#include "services/studio/recording/live_recording.h"
#include "services/studio/recording/session_file.h"
#include "weft/v1/recorder.pb.h"

namespace weft {
namespace {

constexpr double kStatePeriod_s = 0.25;
constexpr double kLeastRecorded_s = 1;  // before that the rate says little

// Whoever looks sees whole states, the latest at once; none is worth a flush, which might hold up the
// recording.
void ShowState(const RecorderFiles& files, v1::RecorderState& state) {
  state.set_updated_unix_ns(HostTime_ns());
  const absl::StatusOr<std::string> json = ToJson(state);
  const std::string next = files.state + ".next";
  if (!json.ok() || !(std::ofstream(next) << *json).flush()) return;
  std::error_code ignored;
  std::filesystem::rename(next, files.state, ignored);
}

double DiskMinutesLeft(const v1::RecorderState& state, const RecorderCounters& counters) {
  if (!counters.room_bytes || state.bytes_written() == 0 || state.elapsed_s() < kLeastRecorded_s) return -1;
  const double rate = static_cast<double>(state.bytes_written()) / state.elapsed_s();
  return static_cast<double>(*counters.room_bytes) / rate / 60;
}

void Describe(const LiveRecordingState& live, v1::RecorderState& state) {
  state.set_phase(v1::RECORDER_PHASE_RECORDING);
  state.set_elapsed_s(live.elapsed_s);
  state.set_sets_recorded(live.recorder.sets_recorded);
  state.set_sets_dropped(live.recorder.sets_dropped);
  state.set_frames_missing(live.recorder.frames_missing);
  state.set_bytes_written(live.recorder.bytes_written);
  state.set_queued_bytes(live.recorder.queued_bytes);
  for (size_t i = 0; i < live.cameras.size(); ++i) {
    v1::RecorderCamera& camera = *state.mutable_cameras(static_cast<int>(i));
    const LiveCameraState& of = live.cameras[i];
    of.DescribeTo(camera);
    camera.set_is_away(of.is_away);
  }
}

// Room on the disk for the last state, which says why a take ended on a full one.
void KeepRoom(const RecorderFiles& files) {
  constexpr size_t kRoom_bytes = 64 << 10;
  std::ofstream(files.room) << std::string(kRoom_bytes, '.');
}

void GiveRoom(const RecorderFiles& files) { RemoveFile(files.room); }

absl::Status Record(const std::string& folder, const std::atomic<bool>& stop, v1::RecorderState& state) {
  const RecorderFiles files(folder);
  v1::RecorderRequest request;
  WEFT_RETURN_IF_ERROR(ReadJsonFile(files.request, request));
  WEFT_ASSIGN_OR_RETURN(LiveRecordingOptions recording, RecordingOptionsOf(request.session()));
  recording.seconds = request.seconds();
  WEFT_ASSIGN_OR_RETURN(const auto cameras, OpenCameras(request.session()));
  for (const auto& camera : cameras) state.add_cameras()->set_id(camera->camera_id());
  for (const std::string& warning : ClockWarnings(cameras)) state.add_warnings(warning);
  if (!request.no_disk_test()) {
    WEFT_ASSIGN_OR_RETURN(const auto warnings, TestDisk(folder, cameras, recording, "no_disk_test"));
    for (const std::string& warning : warnings) state.add_warnings(warning);
  }
  Stopwatch shown;
  const auto show = [&](const LiveRecordingState& live) {
    if (state.phase() == v1::RECORDER_PHASE_RECORDING && shown.Seconds() < kStatePeriod_s) return;
    Describe(live, state);
    state.set_disk_minutes_left(DiskMinutesLeft(state, live.recorder));
    ShowState(files, state);
    shown = {};
  };
  WEFT_ASSIGN_OR_RETURN(const v1::Take take, RecordLive(files.take, cameras, recording, stop, show));
  state.set_message(take.stop_cause());
  state.set_sets_recorded(take.sets_recorded());
  state.set_sets_dropped(take.sets_dropped());
  state.set_frames_missing(take.frames_missing());
  return absl::OkStatus();
}

}  // namespace

absl::Status RunRecorder(const std::string& folder, const std::atomic<bool>& stop) {
  const RecorderFiles files(folder);
  v1::RecorderState state;
  state.set_phase(v1::RECORDER_PHASE_STARTING);
  state.set_disk_minutes_left(-1);
  ShowState(files, state);
  KeepRoom(files);
  const absl::Status status = Record(folder, stop, state);
  GiveRoom(files);
  state.set_phase(status.ok() ? v1::RECORDER_PHASE_ENDED : v1::RECORDER_PHASE_FAILED);
  if (!status.ok()) {
    state.set_error_code(absl::StatusCodeToString(status.code()));
    state.set_message(std::string(status.message()));
  }
  state.set_updated_unix_ns(HostTime_ns());
  const absl::Status written = WriteJsonFile(files.state, state);
  return status.ok() ? written : status;
}

}  // namespace weft
