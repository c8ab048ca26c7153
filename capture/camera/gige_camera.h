// GigE Vision cameras through Aravis.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/camera/camera_source.h"
#include "capture/camera/frame_count.h"
#include "capture/camera/gige_device.h"

namespace weft {

struct GigeCameraOptions {
  std::string id;                     // of the camera in the take
  std::string device;                 // address, serial number or name by which Aravis knows it
  std::vector<std::string> features;  // "Name=value", any GenICam feature, set in this order
  double fps = 0;                     // free run; 0: as the features say
  CameraTrigger trigger;
  bool ptp = false;               // follow the network's PTP clock; Start waits for it
  int ptp_wait_ms = 15000;        // for that long
  bool chunk_timestamps = false;  // the time inside the frame (ChunkTimestamp) instead of the packet's
  int packet_size_bytes = 0;      // 0: the largest that the network lets through
  bool resend = true;             // ask for lost packets again
  bool packet_socket = true;      // receive beside the network stack, where the process may
  int retention_ms = 200;         // how long a frame waits for packets that were asked for again
  int clock_interval_ms = 1000;   // between readings of its clock; 0: none
  int buffers = 16;               // frames that wait for Next
  int reconnect_interval_ms = 500;

  absl::Status Validate() const;
};

// Opens the camera, sets its features and reads them back. NotFound: no such camera. InvalidArgument: a
// feature that the camera lacks or a value that it refuses, both named. Unavailable: it does not answer.
// FailedPrecondition: another program controls it. Aravis looks for cameras on every network interface; it
// takes about a second.
absl::StatusOr<std::unique_ptr<CameraSource>> OpenGigeCamera(const GigeCameraOptions& options);

}  // namespace weft
