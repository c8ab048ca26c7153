// weft camera look: what the cameras of a daemon see.
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/recording/session_file.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/client/camera_client.h"

namespace weft {
namespace {

struct CameraLookOptions {
  std::string server;
  std::string session, lease, take_id;
  std::string camera_id;
  std::string out;
  int width_px = 640;
  bool json = false;
};

absl::StatusOr<v1::LookAtCamerasRequest> RequestOf(const CameraLookOptions& options) {
  v1::LookAtCamerasRequest request;
  if (!options.take_id.empty()) {
    request.set_take_id(options.take_id);
  } else if (!options.session.empty()) {
    WEFT_ASSIGN_OR_RETURN(*request.mutable_cameras(), ReadSession(options.session));
  } else if (!options.lease.empty()) {
    request.set_lease(options.lease);
  } else {
    return absl::InvalidArgumentError(
        "give --session FILE, --take ID, or the --lease of a session (or WEFT_LEASE)");
  }
  request.set_camera_id(options.camera_id);
  request.set_width_px(options.width_px);
  return request;
}

void PrintLook(const v1::CameraLook& look) {
  const v1::TakeCamera& camera = look.camera();
  if (!look.problem().empty()) {
    std::printf("%s  no picture: %s\n", camera.id().c_str(), look.problem().c_str());
    return;
  }
  std::printf("%s  %s, %d x %d, %s, median %d of 255, %.1f %% clipped, %.1f %% dark, focus %.4f\n",
              camera.id().c_str(), camera.model().c_str(), camera.width_px(), camera.height_px(),
              camera.pixel_format().c_str(), look.median_value(), 100 * look.clipped_share(),
              100 * look.dark_share(), look.focus());
}

absl::Status LookAtCameras(const CameraLookOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::LookAtCamerasRequest request, RequestOf(options));
  WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options.server));
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::CameraLook> looks, CameraClient(*connection).Look(request));
  if (!options.out.empty()) {
    WEFT_RETURN_IF_ERROR(CreateFolders(options.out));
  }
  for (v1::CameraLook& look : looks) {
    if (!options.out.empty() && !look.jpeg().empty()) {
      const std::string file = absl::StrCat(options.out, "/", look.camera().id(), ".jpg");
      WEFT_RETURN_IF_ERROR(WriteFileAtomically(file, look.jpeg()));
    }
    look.clear_jpeg();
    if (!options.json) {
      PrintLook(look);
    } else if (absl::Status status = PrintJsonMessage(look); !status.ok()) {
      return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace

void AddCameraLookCommand(CLI::App& camera, CommandLine& line) {
  const auto [look, options] = AddCommand<CameraLookOptions>(
      camera, line, LookAtCameras, "look",
      "See what the cameras of a daemon see, and how they are exposed and focused. Cameras that nobody uses "
      "are opened as a take would open them, for a second; of a take that runs it is the newest frame set.",
      "  weft camera look --session session.json --out pictures --server 127.0.0.1:7411\n"
      "  weft camera look --take 20260131-104500-1a2b3c4d --camera left --out pictures --server "
      "127.0.0.1:7411");
  AddServerOption(*look, options->server, "HOST:PORT of the daemon")->required();
  AddOption(*look, "--session FILE", options->session, "session.json with the cameras");
  AddOption(*look, "--take ID", options->take_id, "Id of a take, as `weft take list` prints it");
  AddOption(*look, "--lease LEASE", options->lease, "Of the session that has the cameras")
      ->envname("WEFT_LEASE");
  AddOption(*look, "--camera ID", options->camera_id, "This one alone");
  AddOption(*look, "--width-px PX", options->width_px, "Pictures are at most this wide", CLI::Range(1, 4096));
  AddOption(*look, "--out DIR", options->out, "Folder for the pictures, <camera>.jpg");
  look->add_flag("--json", options->json,
                 "Print JSON (weft.v1.CameraLook), one per camera, with all settings");
}

}  // namespace weft
