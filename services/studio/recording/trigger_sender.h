// Triggers that are Weft's to send: software triggers and action commands.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "capture/camera/action_command.h"
#include "capture/camera/camera_source.h"
#include "capture/camera/gige_device.h"
#include "capture/sync/frame_set_assembler.h"
#include "services/studio/recording/clock_log.h"

namespace weft {

struct TriggerOptions {
  TriggerKind kind = TriggerKind::kFreeRun;
  ActionCommand keys;            // of kAction
  int64_t period_ns = 0;         // between triggers of ours, which come at multiples of it
  int64_t lead_ns = 20'000'000;  // an action command is sent so long before its time
  ClockDomain clocks = ClockDomain::kShared;

  // Free run and hardware lines need nothing of us.
  bool IsOurs() const { return kind == TriggerKind::kSoftware || kind == TriggerKind::kAction; }
  absl::Status Validate() const;
};

// A thread that triggers the cameras that take triggers, from its construction until Stop. `note` receives
// what fails, once per camera and message.
class TriggerSender {
 public:
  using Note = std::function<void(size_t camera, const std::string& what)>;

  // The cameras and the log outlive the sender.
  static absl::StatusOr<std::unique_ptr<TriggerSender>> Start(
      const std::vector<std::unique_ptr<CameraSource>>& cameras, const TriggerOptions& options,
      const ClockLog& clocks, Note note);
  ~TriggerSender() { Stop(); }
  void Stop();

 private:
  TriggerSender(const std::vector<std::unique_ptr<CameraSource>>& cameras, const TriggerOptions& options,
                const ClockLog& clocks, Note note, ActionSender sender);
  void Run();
  void Send(int64_t at_host_ns);
  void FollowSharedClock();
  absl::Status SendAction(size_t camera, int64_t at_host_ns);

  const std::vector<std::unique_ptr<CameraSource>>& cameras_;
  const TriggerOptions options_;
  const ClockLog& clocks_;
  const Note note_;
  ActionSender sender_;
  std::vector<std::string> addresses_, failures_;  // by camera
  size_t first_triggered_ = 0;                     // its readings are those of the common clock
  std::optional<int64_t> shared_minus_host_ns_;    // of the common clock
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace weft
