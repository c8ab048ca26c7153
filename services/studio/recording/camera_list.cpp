#include "services/studio/recording/camera_list.h"

#include "absl/strings/str_cat.h"
#include "capture/camera/gige_discovery.h"
#include "capture/camera/v4l2_device.h"

namespace weft {

v1::CameraList ListCameras() {
  v1::CameraList list;
  for (const FoundCamera& found : FindGigeCameras()) {
    v1::ListedCamera& camera = *list.add_cameras();
    camera.set_kind("gige");
    camera.set_device(found.address);
    camera.set_model(absl::StrCat(found.vendor, " ", found.model));
    camera.set_serial(found.serial);
    if (IsControlled(found.address)) camera.set_used_by("another program");
  }
  for (const V4l2Identity& found : FindV4l2Cameras()) {
    v1::ListedCamera& camera = *list.add_cameras();
    camera.set_kind("v4l2");
    camera.set_device(found.path);
    camera.set_model(found.card);
    camera.set_serial(found.serial);
    camera.set_bus(found.bus);
    const absl::StatusOr<V4l2Device> device = V4l2Device::Open("at " + found.path, found.path);
    if (!device.ok()) {
      camera.set_problem(std::string(device.status().message()));
      continue;
    }
    for (const std::string& format : device->Formats()) camera.add_formats(format);
    for (const std::string& control : device->Controls()) camera.add_controls(control);
  }
  return list;
}

std::string CameraListText(const v1::CameraList& list, bool details) {
  std::string text;
  for (const v1::ListedCamera& camera : list.cameras()) {
    absl::StrAppend(&text, camera.kind(), "  ", camera.device());
    if (!camera.model().empty()) absl::StrAppend(&text, "  ", camera.model());
    if (!camera.serial().empty()) absl::StrAppend(&text, ", serial ", camera.serial());
    if (!camera.bus().empty()) absl::StrAppend(&text, ", at ", camera.bus());
    if (!camera.used_by().empty()) absl::StrAppend(&text, "  in use: ", camera.used_by());
    if (!camera.problem().empty()) absl::StrAppend(&text, "  ", camera.problem());
    text += '\n';
    if (!details) continue;
    for (const std::string& format : camera.formats()) absl::StrAppend(&text, "      ", format, "\n");
    for (const std::string& control : camera.controls()) absl::StrAppend(&text, "      ", control, "\n");
  }
  if (text.empty())
    text =
        "no camera: none answers in the network by GigE Vision, and there is none at /dev/video*; "
        "`weft doctor` searches for the cause\n";
  return text;
}

}  // namespace weft
