// From live cameras to a take: a thread per camera, triggers, frame sets, the recorder.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/camera/camera_source.h"
#include "capture/sync/frame_set_assembler.h"
#include "services/studio/recording/recorder.h"
#include "services/studio/recording/trigger_sender.h"
#include "weft/v1/take.pb.h"

namespace weft {

struct LiveRecordingOptions {
  FrameSetOptions sets;
  RecorderOptions recorder;
  TriggerOptions trigger;
  double seconds = 0;  // 0: until told to stop
  // Shown every set before it is recorded, while less than half of the recorder's queue is full: who looks on
  // costs no frames. Must not wait.
  std::function<void(const RawFrameSet&)> look;
};

// What became of one camera's frames.
struct LiveCameraState {
  CameraCounters receiver;
  uint64_t frames_lost = 0;  // triggers that ended without a frame of it, whatever the cause
  uint64_t disconnections = 0, reconnections = 0;
  bool is_away = false;  // disconnected, or it does not answer

  // v1::TakeCamera, or v1::RecorderCamera.
  template <typename Camera>
  void DescribeTo(Camera& camera) const {
    camera.set_frames_received(receiver.frames);
    camera.set_frames_lost(frames_lost);
    camera.set_packets_resent(receiver.packets_resent);
    camera.set_packets_missing(receiver.packets_missing);
    camera.set_disconnections(disconnections);
    camera.set_reconnections(reconnections);
  }
};

struct LiveRecordingState {
  double elapsed_s = 0;
  RecorderCounters recorder;
  std::vector<LiveCameraState> cameras;
};

// What an operator should know of cameras whose clocks cannot be read, a line per cause.
std::vector<std::string> ClockWarnings(const std::vector<std::unique_ptr<CameraSource>>& cameras);

// Starts the cameras, records their frames into a new take at `folder`, and stops them. Recording ends
// after `seconds`, when `stop` becomes true, when the recorder stops, or when every source has ended. The
// take holds the triggers from the first at which all cameras deliver to the last that began before the
// end. The ledger counts those that no camera reported. Frames of cameras whose clocks cannot be read are
// assigned by their arrival, as take.json says. Recording ends on time also when cameras have
// disconnected. `report` is called several times a second. The take and its take.json are complete when it
// returns, also after an error of the disk; where a camera does not start nothing is written.
absl::StatusOr<v1::Take> RecordLive(const std::string& folder,
                                    const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                    const LiveRecordingOptions& options, const std::atomic<bool>& stop,
                                    const std::function<void(const LiveRecordingState&)>& report = nullptr);

}  // namespace weft
