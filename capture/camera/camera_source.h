// Live cameras.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "capture/camera/clock_track.h"
#include "capture/image/raw_frame.h"

namespace weft {

// What a camera has to say next.
struct CameraDelivery {
  enum class Kind {
    kFrame,         // a whole frame
    kLostFrame,     // the camera took a frame that did not arrive whole; `cause` says why
    kSilent,        // it does not answer; kDisconnected follows unless it answers again
    kAnswers,       // it does again
    kDisconnected,  // the camera is gone; the source looks for it
    kEnded,         // the source has no more to deliver, as a replay at its end
    kReconnected,   // it is back, its counters and its clock may have begun anew
    kClock,         // its clock was read: `clock`
    kNote,          // anything else that belongs into the ledger
  };
  Kind kind = Kind::kFrame;
  RawFrame frame;     // kLostFrame: number and times alone, 0 where the camera did not say
  std::string cause;  // in words
  ClockReading clock;
};

// Running totals of a camera.
struct CameraCounters {
  uint64_t frames = 0;
  uint64_t frames_lost = 0;  // that it took, and that did not arrive whole
  uint64_t packets_resent = 0;
  uint64_t packets_missing = 0;
  uint64_t disconnections = 0;
};

// One camera, from its opening to its end. A camera that goes away is looked for again; meanwhile Next says
// so once and then has nothing. Frames are whole or reported as lost, never in parts. Thread safety: one
// thread calls Next; any thread may call the rest.
class CameraSource {
 public:
  virtual ~CameraSource() = default;

  virtual const std::string& camera_id() const = 0;
  // The camera's features as it answered them, and what the source made of them (model, packet size, ...).
  virtual std::map<std::string, std::string> settings() const = 0;
  // What has to happen before any camera of the session films; once, before Start.
  virtual absl::Status Prepare() { return absl::OkStatus(); }
  virtual absl::Status Start() = 0;
  // DeadlineExceeded: nothing within the time. OutOfRange: the source has ended and will deliver no more.
  virtual absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds timeout) = 0;
  virtual void Stop() = 0;
  // False: the camera films by its own clock alone.
  virtual bool TakesTriggers() const { return true; }
  // Takes one frame now, where the camera is configured to be triggered so.
  virtual absl::Status Trigger() {
    return absl::UnimplementedError("camera " + camera_id() + " takes no trigger of ours");
  }
  // The camera's clock is read before the next frame, where it was not just read. From the thread of Next.
  virtual void AskForClock() {}
  // Why the camera's clock cannot be read, in words ("it reads 0"); empty where it can.
  virtual std::string ClockProblem() const { return ""; }
  virtual CameraCounters counters() const = 0;
};

}  // namespace weft
