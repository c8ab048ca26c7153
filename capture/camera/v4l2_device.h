// Control of a V4L2 camera: identity, image format, rate, controls.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/image/raw_frame.h"

namespace weft {

// The format of a code of V4L2 (a "fourcc"). InvalidArgument: none that we know.
absl::StatusOr<RawFormat> RawFormatOfV4l2(uint32_t code);
// As V4L2 writes its codes: "YUYV", "Y10 ".
std::string V4l2CodeText(uint32_t code);

struct V4l2Identity {
  std::string path, driver, card, bus;  // bus: the port at which it hangs; stays when the path changes
  std::string serial;                   // of its USB device; empty where there is none
};

// Images as they lie in the driver's buffers.
struct V4l2Image {
  RawFormat format = RawFormat::kMono8;
  int width_px = 0, height_px = 0;
  uint64_t line_bytes = 0;    // from line to line; 0 where the format has no lines (motion JPEG)
  uint64_t buffer_bytes = 0;  // that a buffer must hold
};

// Image sizes, rates and values are asked of the driver; what it refuses is an InvalidArgument that lists
// what it allows. Unavailable: it answers no more. Thread safety: none.
class V4l2Device {
 public:
  // `device`: a path, or bus or card of exactly one camera. NotFound, PermissionDenied (with the remedy), or
  // InvalidArgument: no camera, or one whose images come in several planes. `camera_id` is for messages.
  static absl::StatusOr<V4l2Device> Open(const std::string& camera_id, const std::string& device);
  V4l2Device(V4l2Device&& other) noexcept;
  V4l2Device& operator=(V4l2Device&&) = delete;
  ~V4l2Device();

  int fd() const { return fd_; }
  const V4l2Identity& identity() const { return identity_; }

  // `format`: name of a RawFormat or code of V4L2, empty: as the device stands, or the first that Weft knows.
  // Sizes of 0 are left as they are.
  absl::StatusOr<V4l2Image> SetImage(const std::string& format, int width_px, int height_px);
  absl::Status SetRate(double fps);
  // Frames per second as set; 0 where the driver does not say.
  double Rate() const;
  // "Name=value"; the name of a button alone pushes it. Names of controls and of menu entries are compared
  // without case, blanks and signs.
  absl::Status SetControl(const std::string& assignment);
  // Has the driver tell of changes of this control, and of its source.
  void WatchControl(const std::string& assignment);
  void WatchSource();
  // Name of the control that an event is about; empty where there is none.
  std::string ControlName(uint32_t id) const;

  // "YUV422_8 (YUYV) 320x180, 640x360; ...", formats that Weft does not know in brackets.
  std::vector<std::string> Formats() const;
  // "Gain = 7 (0 to 255 in steps of 1)", "Power Line Frequency = 50 Hz (Disabled, 50 Hz, 60 Hz)".
  std::vector<std::string> Controls() const;
  // Values of all controls by name, for the record of a take.
  std::map<std::string, std::string> ControlValues() const;

 private:
  struct Control;

  V4l2Device(std::string camera_id, int fd) : id_(std::move(camera_id)), fd_(fd) {}
  absl::Status Refused(const std::string& what) const;
  absl::Status Failed(const std::string& what) const;
  absl::Status Identify(const std::string& path);
  std::vector<Control> AllControls() const;
  absl::StatusOr<Control> FindControl(const std::string& name) const;
  std::vector<std::string> Menu(const Control& control) const;
  std::string AllowedValues(const Control& control) const;
  std::string Value(const Control& control) const;
  absl::StatusOr<int64_t> ParseValue(const Control& control, const std::string& value) const;
  std::string Sizes(uint32_t code) const;
  std::string Rates() const;

  std::string id_;
  int fd_ = -1;
  V4l2Identity identity_;
};

// The cameras of this machine, in the order of their paths. Those that may not be opened are there with their
// path alone.
std::vector<V4l2Identity> FindV4l2Cameras();

}  // namespace weft
