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
  sets.drop_incomplete = session.drop_incomplete();
  if (session.clocks() == v1::SESSION_CLOCKS_ESTIMATED) sets.clocks = ClockDomain::kEstimated;
  options.recorder.take.stream.compress = session.compress();
  if (session.queue_mib() > 0)
    options.recorder.queue_bytes = static_cast<uint64_t>(session.queue_mib()) << 20;
  if (session.low_disk_gib() > 0)
    options.recorder.low_disk_bytes = static_cast<uint64_t>(session.low_disk_gib() * (1 << 30));
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
    if (camera.gige().buffers() > 0) options.buffers = camera.gige().buffers();
    auto source = OpenGigeCamera(options);
    if (!source.ok()) return source.status();
    cameras.push_back(*std::move(source));
  }
  return cameras;
}

}  // namespace weft
