#include "services/recording/session_file.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/gige_camera.h"
#include "capture/take_format.h"
#include "services/files/json_file.h"

namespace weft {
namespace {

TriggerKind KindOf(v1::SessionTriggerKind kind) {
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
  trigger.kind = KindOf(from.kind());
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

constexpr int64_t kStartWait_ns = 5'000'000'000;

}  // namespace

absl::StatusOr<v1::Session> ReadSession(const std::string& path) {
  v1::Session session;
  if (absl::Status status = ReadJsonFile(path, session); !status.ok()) return status;
  if (session.cameras().empty())
    return absl::InvalidArgumentError(absl::StrCat(path, ": the field cameras is empty"));
  std::set<std::string> ids;
  for (int i = 0; i < session.cameras_size(); ++i) {
    const v1::SessionCamera& camera = session.cameras(i);
    const std::string field = absl::StrCat(path, ": cameras[", i, "]");
    if (absl::Status status = CheckCameraId(camera.id()); !status.ok())
      return absl::InvalidArgumentError(absl::StrCat(field, ": ", status.message()));
    if (!ids.insert(camera.id()).second)
      return absl::InvalidArgumentError(absl::StrCat(field, ": the id ", camera.id(), " occurs twice"));
    if (camera.gige().device().empty())
      return absl::InvalidArgumentError(
          absl::StrCat(field, " (id ", camera.id(), "): the field gige.device is missing"));
  }
  const absl::StatusOr<LiveRecordingOptions> options = RecordingOptionsOf(session);
  if (!options.ok()) return absl::InvalidArgumentError(absl::StrCat(path, ": ", options.status().message()));
  return session;
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
  if (absl::Status status = options.trigger.Validate(); !status.ok()) return status;
  if (absl::Status status = sets.Validate(); !status.ok()) return status;
  return options;
}

absl::StatusOr<std::vector<std::unique_ptr<CameraSource>>> OpenCameras(const v1::Session& session) {
  std::vector<std::unique_ptr<CameraSource>> cameras;
  for (const v1::SessionCamera& camera : session.cameras()) {
    GigeCameraOptions options;
    options.id = camera.id();
    options.device = camera.gige().device();
    options.features.assign(camera.gige().features().begin(), camera.gige().features().end());
    options.fps = session.fps();
    options.packet_size_bytes = camera.gige().packet_size_bytes();
    options.resend = !camera.gige().no_resend();
    options.packet_socket = !camera.gige().no_packet_socket();
    options.chunk_timestamps = camera.gige().chunk_timestamps();
    options.trigger = TriggerOf(session);
    options.ptp = session.ptp();
    if (session.ptp_wait_s() > 0)
      options.ptp_wait_ms = static_cast<int>(std::lround(1000 * session.ptp_wait_s()));
    if (camera.gige().buffers() > 0) options.buffers = camera.gige().buffers();
    options.retention_ms = Retention_ms(session, options.buffers);
    auto source = OpenGigeCamera(options);
    if (!source.ok()) return source.status();
    cameras.push_back(*std::move(source));
  }
  return cameras;
}

}  // namespace weft
