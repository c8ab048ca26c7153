#include "services/studio/recording/session_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "capture/camera/gige_camera.h"
#include "capture/camera/v4l2_camera.h"
#include "capture/take/replay.h"
#include "capture/take/take_format.h"
#include "services/formats/files/json_file.h"

namespace weft {
namespace {

TriggerKind KindOfField(v1::SessionTriggerKind kind) {
  switch (kind) {
    case v1::SESSION_TRIGGER_KIND_SOFTWARE:
      return TriggerKind::kSoftware;
    case v1::SESSION_TRIGGER_KIND_LINE:
      return TriggerKind::kLine;
    case v1::SESSION_TRIGGER_KIND_ACTION:
      return TriggerKind::kAction;
    default:
      return TriggerKind::kFreeRun;
  }
}

CameraTrigger TriggerOf(const v1::Session& session) {
  const v1::SessionTrigger& from = session.trigger();
  CameraTrigger trigger;
  trigger.kind = KindOfField(from.kind());
  if (!from.line().empty()) trigger.line = from.line();
  if (from.device_key() != 0) trigger.device_key = from.device_key();
  if (from.group_key() != 0) trigger.group_key = from.group_key();
  if (from.group_mask() != 0) trigger.group_mask = from.group_mask();
  return trigger;
}

// A frame that waits for packets holds up those behind it: they must fit into the buffers, and their sets
// must wait.
int Retention_ms(const v1::Session& session, int buffers) {
  const double max_wait_ms = session.max_wait_ms() > 0 ? session.max_wait_ms() : 500;
  const double buffered_ms = session.fps() > 0 ? 1000 * buffers / session.fps() : max_wait_ms;
  return std::max(20, static_cast<int>(0.5 * std::min(max_wait_ms, buffered_ms)));
}

// Empty where the camera is of one kind and says which device it is.
std::string FaultOf(const v1::SessionCamera& camera) {
  const int kinds = static_cast<int>(camera.has_gige()) + static_cast<int>(camera.has_v4l2()) +
                    static_cast<int>(camera.has_replay());
  if (kinds != 1) return "it needs one of the fields gige, v4l2 and replay";
  if (camera.has_gige() && camera.gige().device().empty()) return "the field gige.device is missing";
  if (camera.has_v4l2() && camera.v4l2().device().empty()) return "the field v4l2.device is missing";
  if (camera.has_replay() && camera.replay().take().empty()) return "the field replay.take is missing";
  if (!(camera.replay().speed() >= 0)) return "the field replay.speed is negative";
  return "";
}

// As it is written; empty for a replay, whose take has several cameras.
std::string DeviceOf(const v1::SessionCamera& camera) {
  if (camera.has_gige()) return camera.gige().device();
  return camera.has_v4l2() ? camera.v4l2().device() : "";
}

// V4L2 cameras take no triggers of ours, nor do they know PTP.
absl::Status AddTiming(const v1::Session& session, FrameSetOptions& sets) {
  bool has_leader = false, has_shared_clock = false;
  const bool free_run = KindOfField(session.trigger().kind()) == TriggerKind::kFreeRun;
  for (const v1::SessionCamera& camera : session.cameras()) {
    sets.cameras.push_back({camera.has_v4l2(), camera.unsynchronized()});
    has_leader = has_leader || !camera.unsynchronized();
    has_shared_clock = has_shared_clock || !camera.has_v4l2();
    if (camera.has_v4l2() && !camera.unsynchronized() && !free_run &&
        KindOfField(session.trigger().kind()) != TriggerKind::kLine)
      return absl::InvalidArgumentError(absl::StrCat(
          "camera ", camera.id(), ": V4L2 cameras take no triggers from Weft; set its `unsynchronized`"));
  }
  if (!has_leader)
    return absl::InvalidArgumentError(
        "every camera is `unsynchronized`; at least one must define the triggers");
  if (!has_shared_clock) sets.clocks = ClockDomain::kEstimated;
  return absl::OkStatus();
}

constexpr int64_t kStartWait_ns = 5'000'000'000;

}  // namespace

absl::StatusOr<v1::Session> ReadSession(const std::string& path) {
  v1::Session session;
  WEFT_RETURN_IF_ERROR(ReadJsonFile(path, session));
  WEFT_RETURN_IF_ERROR(CheckSession(session, path));
  for (v1::SessionCamera& camera : *session.mutable_cameras()) {
    if (!camera.has_replay() || absl::StartsWith(camera.replay().take(), kTakePrefix)) continue;
    const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
    camera.mutable_replay()->set_take((folder / camera.replay().take()).lexically_normal().string());
  }
  return session;
}

std::set<std::string> DevicesOf(const v1::Session& session) {
  std::set<std::string> devices;
  for (const v1::SessionCamera& camera : session.cameras()) {
    if (camera.has_gige()) devices.insert(camera.gige().device());
    if (camera.has_v4l2()) devices.insert(camera.v4l2().device());
  }
  return devices;
}

std::set<std::string> ReplayedTakesOf(const v1::Session& session) {
  std::set<std::string> takes;
  for (const v1::SessionCamera& camera : session.cameras()) {
    if (camera.has_replay()) takes.insert(camera.replay().take());
  }
  return takes;
}

absl::Status CheckSession(const v1::Session& session, const std::string& source) {
  if (session.cameras().empty())
    return absl::InvalidArgumentError(absl::StrCat(source, ": the field cameras is empty"));
  std::set<std::string> ids;
  std::map<std::string, std::string> devices;  // the camera of each
  for (int i = 0; i < session.cameras_size(); ++i) {
    const v1::SessionCamera& camera = session.cameras(i);
    const std::string field = absl::StrCat(source, ": cameras[", i, "]");
    if (absl::Status status = CheckCameraId(camera.id()); !status.ok())
      return absl::InvalidArgumentError(absl::StrCat(field, ": ", status.message()));
    if (!ids.insert(camera.id()).second)
      return absl::InvalidArgumentError(absl::StrCat(field, ": the id ", camera.id(), " occurs twice"));
    if (const std::string fault = FaultOf(camera); !fault.empty())
      return absl::InvalidArgumentError(absl::StrCat(field, " (id ", camera.id(), "): ", fault));
    const std::string device = DeviceOf(camera);
    if (const auto [other, is_new] = devices.try_emplace(device, camera.id()); !device.empty() && !is_new)
      return absl::InvalidArgumentError(absl::StrCat(field, " (id ", camera.id(), "): the device ", device,
                                                     " is that of camera ", other->second, " already"));
  }
  const absl::StatusOr<LiveRecordingOptions> options = RecordingOptionsOf(session);
  if (options.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(source, ": ", options.status().message()));
}

absl::StatusOr<LiveRecordingOptions> RecordingOptionsOf(const v1::Session& session) {
  if (!(session.fps() >= 0)) return absl::InvalidArgumentError("fps must not be negative");
  if (!(session.tolerance_ms() >= 0)) return absl::InvalidArgumentError("tolerance_ms must not be negative");
  if (session.queue_mib() < 0) return absl::InvalidArgumentError("queue_mib must not be negative");
  LiveRecordingOptions options;
  FrameSetOptions& sets = options.sets;
  if (session.fps() > 0) {
    sets.period_ns = std::llround(1e9 / session.fps());
    sets.tolerance_ns = std::min(sets.tolerance_ns, sets.period_ns / 5);
  }
  if (session.tolerance_ms() > 0) sets.tolerance_ns = std::llround(1e6 * session.tolerance_ms());
  if (session.max_wait_ms() > 0) sets.max_wait_ns = std::llround(1e6 * session.max_wait_ms());
  sets.start_wait_ns = kStartWait_ns;
  sets.drop_incomplete = session.drop_incomplete();
  if (session.clocks() == v1::SESSION_CLOCKS_ESTIMATED) sets.clocks = ClockDomain::kEstimated;
  WEFT_RETURN_IF_ERROR(AddTiming(session, sets));
  options.recorder.take.stream.compress = session.compress();
  if (session.queue_mib() > 0)
    options.recorder.queue_bytes = static_cast<uint64_t>(session.queue_mib()) << 20;
  if (session.low_disk_gib() > 0)
    options.recorder.low_disk_bytes = static_cast<uint64_t>(session.low_disk_gib() * (1 << 30));
  const CameraTrigger trigger = TriggerOf(session);
  options.trigger.kind = trigger.kind;
  options.trigger.keys = {trigger.device_key, trigger.group_key, trigger.group_mask, {}};
  options.trigger.period_ns = sets.period_ns;
  options.trigger.clocks = sets.clocks;
  if (session.trigger().lead_ms() != 0)
    options.trigger.lead_ns = std::llround(1e6 * session.trigger().lead_ms());
  WEFT_RETURN_IF_ERROR(options.trigger.Validate());
  WEFT_RETURN_IF_ERROR(sets.Validate());
  return options;
}

namespace {

absl::StatusOr<std::unique_ptr<CameraSource>> OpenGige(const v1::Session& session,
                                                       const v1::SessionCamera& camera) {
  GigeCameraOptions options;
  options.id = camera.id();
  options.device = camera.gige().device();
  options.features.assign(camera.gige().features().begin(), camera.gige().features().end());
  options.fps = session.fps();
  options.packet_size_bytes = camera.gige().packet_size_bytes();
  options.resend = !camera.gige().no_resend();
  options.packet_socket = !camera.gige().no_packet_socket();
  options.chunk_timestamps = camera.gige().chunk_timestamps();
  options.trigger = camera.unsynchronized() ? CameraTrigger{} : TriggerOf(session);
  options.ptp = session.ptp();
  if (session.ptp_wait_s() > 0)
    options.ptp_wait_ms = static_cast<int>(std::lround(1000 * session.ptp_wait_s()));
  if (camera.gige().buffers() > 0) options.buffers = camera.gige().buffers();
  options.retention_ms = Retention_ms(session, options.buffers);
  return OpenGigeCamera(options);
}

absl::StatusOr<std::unique_ptr<CameraSource>> OpenV4l2(const v1::Session& session,
                                                       const v1::SessionCamera& camera) {
  const v1::V4l2Camera& from = camera.v4l2();
  V4l2CameraOptions options;
  options.id = camera.id();
  options.device = from.device();
  options.format = from.format();
  options.width_px = from.width_px();
  options.height_px = from.height_px();
  options.controls.assign(from.controls().begin(), from.controls().end());
  options.fps = session.fps();
  options.memory = from.user_buffers() ? V4l2Memory::kUser : V4l2Memory::kMmap;
  if (from.buffers() > 0) options.buffers = from.buffers();
  return OpenV4l2Camera(options);
}

// By folder and speed: cameras of one take share its clock.
using Replays = std::map<std::pair<std::string, double>, std::shared_ptr<Replay>>;

absl::StatusOr<std::unique_ptr<CameraSource>> OpenReplay(const v1::SessionCamera& camera, Replays& replays) {
  const v1::ReplayCamera& from = camera.replay();
  std::shared_ptr<Replay>& replay = replays[{from.take(), from.speed()}];
  if (!replay) {
    ReplayOptions options;
    if (from.speed() > 0) options.speed = from.speed();
    WEFT_ASSIGN_OR_RETURN(replay,
                          Naming(absl::StrCat("camera ", camera.id()), Replay::Open(from.take(), options)));
  }
  return OpenReplayCamera(replay, camera.id());
}

}  // namespace

absl::StatusOr<std::vector<std::unique_ptr<CameraSource>>> OpenCameras(const v1::Session& session) {
  std::vector<std::unique_ptr<CameraSource>> cameras;
  Replays replays;
  for (const v1::SessionCamera& camera : session.cameras()) {
    WEFT_ASSIGN_OR_RETURN(auto source, camera.has_replay() ? OpenReplay(camera, replays)
                                       : camera.has_v4l2() ? OpenV4l2(session, camera)
                                                           : OpenGige(session, camera));
    cameras.push_back(std::move(source));
  }
  return cameras;
}

}  // namespace weft
