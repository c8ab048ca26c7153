// Control of a GigE Vision camera: features, trigger, PTP, clock.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/camera/clock_track.h"

struct _ArvDevice;

namespace weft {

// What makes a camera take a frame.
enum class TriggerKind {
  kFreeRun,   // its own clock, at the configured rate
  kSoftware,  // a command to each camera (CameraSource::Trigger)
  kLine,      // an edge at one of its inputs
  kAction,    // an action command of GigE Vision to all cameras, at a time of their common clock
};

struct CameraTrigger {
  TriggerKind kind = TriggerKind::kFreeRun;
  std::string line = "Line1";  // TriggerSource of kLine
  uint32_t device_key = 1;     // action commands with these keys are for this camera
  uint32_t group_key = 1;
  uint32_t group_mask = 1;
};

// A camera that Aravis has opened. `camera_id` is for messages. Thread safety: none.
class GigeDevice {
 public:
  GigeDevice(std::string camera_id, _ArvDevice* device) : id_(std::move(camera_id)), device_(device) {}

  bool Has(const std::string& feature) const;
  // Empty where the camera lacks the feature or does not answer.
  std::string Text(const std::string& feature) const;
  // "Name=value", or the name of a command. InvalidArgument names what the camera lacks or refuses.
  absl::Status Set(const std::string& feature);
  absl::Status Execute(const std::string& command);

  // TriggerSelector, TriggerMode, TriggerSource and the keys of actions.
  absl::Status SetTrigger(const CameraTrigger& trigger);
  // Has it follow the network's PTP clock. InvalidArgument: the camera has no PTP.
  absl::Status EnablePtp();
  // As the camera names it ("Slave"); empty where it has none.
  std::string PtpStatus() const;
  // True in the states in which the camera has the network's time: slave, or master itself.
  bool HasPtpTime() const;

  // Why its clock cannot be read: it reads 0, stands still, has no known rate, or does not answer. Empty
  // where it can. Takes some milliseconds.
  std::string ClockProblem();
  // Latches the camera's clock; the best of a few tries. Unavailable: what ClockProblem says.
  absl::StatusOr<ClockReading> ReadClock();

  bool CanResend() const;  // lost packets
  // The answers to the features that say how it films, and to `more`.
  std::map<std::string, std::string> Describe(const std::vector<std::string>& more) const;

 private:
  absl::StatusOr<uint64_t> TicksPerSecond() const;
  absl::StatusOr<uint64_t> LatchedTicks();

  std::string id_;
  _ArvDevice* device_;
  int64_t latched_before_ns_ = 0, latched_after_ns_ = 0;  // host times around the last latch
  uint64_t last_ticks_ = 0;                               // of the reading before
};

}  // namespace weft
