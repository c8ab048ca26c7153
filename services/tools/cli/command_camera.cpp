// weft camera: the cameras at hand.

#include "services/studio/recording/camera_list.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/client/camera_client.h"

namespace weft {
namespace {

struct CameraListCommandOptions {
  std::string server;
  bool details = false;
  bool json = false;
};

absl::Status PrintCameras(const CameraListCommandOptions& options) {
  v1::CameraList list;
  if (options.server.empty()) {
    list = ListCameras();
  } else {
    WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options.server));
    WEFT_ASSIGN_OR_RETURN(list, CameraClient(*connection).List());
  }
  return PrintMessage(list, options.json, CameraListText(list, options.details));
}

}  // namespace

void AddCameraCommand(CLI::App& app, CommandLine& line) {
  CLI::App* camera = AddGroup(app, "camera", "The cameras at hand, and cameras without hardware.");
  const auto [list, options] = AddCommand<CameraListCommandOptions>(
      *camera, line, PrintCameras, "list",
      "List the cameras that session.json can name: GigE Vision cameras that answer "
      "in the network, and V4L2 cameras of this machine (USB, CSI, frame grabbers).",
      "  weft camera list\n"
      "  weft camera list --server 127.0.0.1:7411\n"
      "  weft camera list --details");
  list->add_flag("--details", options->details, "Formats, sizes and controls of V4L2 cameras, too");
  AddServerOption(*list, options->server, "The cameras of the daemon at HOST:PORT, and who uses them");
  list->add_flag("--json", options->json, "Print JSON (weft.v1.CameraList)");
  AddCameraLookCommand(*camera, line);
  AddCameraFakeCommand(*camera, line);
}

}  // namespace weft
