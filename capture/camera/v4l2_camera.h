// Cameras of this machine through Video4Linux: USB, CSI, frame grabbers.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/camera/camera_source.h"
#include "capture/camera/frame_count.h"
#include "capture/camera/v4l2_stream.h"

namespace weft {

struct V4l2CameraOptions {
  std::string id;                     // of the camera in the take
  std::string device;                 // a path, or bus or card of exactly one camera
  std::string format;                 // name of a RawFormat or code of V4L2; empty: as the device stands
  int width_px = 0, height_px = 0;    // 0: as the device stands
  std::vector<std::string> controls;  // "Name=value", set in this order; a button's name alone pushes it
  double fps = 0;                     // 0: as the device stands
  V4l2Memory memory = V4l2Memory::kMmap;
  int buffers = 8;               // frames that wait for Next in the driver
  int clock_interval_ms = 1000;  // between readings of CLOCK_MONOTONIC, in which frames are dated
  int reconnect_interval_ms = 500;

  absl::Status Validate() const;
};

// Opens the camera and sets its format, rate and controls. Errors of V4l2Device. It films by its own clock.
// Frames that the driver counted and did not deliver are lost frames with a cause. Images that the driver
// marks as damaged, or that are too short, are lost as torn. An unplugged camera is searched for at its
// bus.
absl::StatusOr<std::unique_ptr<CameraSource>> OpenV4l2Camera(const V4l2CameraOptions& options);

}  // namespace weft
