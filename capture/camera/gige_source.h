// A GigE Vision camera as a source of frames; gige_camera.h opens it.
#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "capture/camera/gige_camera.h"
#include "capture/camera/gige_presence.h"
#include "capture/camera/gige_stream.h"

struct _ArvBuffer;
struct _ArvCamera;
struct _ArvChunkParser;

namespace weft {

struct UnrefGObject {
  void operator()(void* object) const;
};
// Configuring, opening and closing are in gige_camera.cpp, deliveries and coming back in gige_deliveries.cpp.
class GigeCamera : public CameraSource {
 public:
  explicit GigeCamera(GigeCameraOptions options) : options_(std::move(options)) {}
  ~GigeCamera() override { Close(); }

  absl::Status Open();
  const std::string& camera_id() const override { return options_.id; }
  std::map<std::string, std::string> settings() const override {
    const MutexLock lock(mutex_);
    return settings_;
  }
  absl::Status Prepare() override { return OpenStream(); }
  absl::Status Start() override;
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds timeout) override;
  void Stop() override;
  bool TakesTriggers() const override { return options_.trigger.kind != TriggerKind::kFreeRun; }
  void AskForClock() override;
  std::string ClockProblem() const override {
    const MutexLock lock(mutex_);
    return clock_problem_;
  }
  absl::Status Trigger() override;
  CameraCounters counters() const override {
    const MutexLock lock(mutex_);
    return counters_;
  }

 private:
  using Clock = std::chrono::steady_clock;
  template <typename T>
  using Object = std::unique_ptr<T, UnrefGObject>;

  absl::Status Configure();
  absl::Status CheckRate();
  absl::Status WaitForPtp();
  absl::Status TakeControl();
  absl::Status OpenStream();
  void UsePacketSocket(bool use, const std::string& setting);
  int64_t DeviceTime_ns(_ArvBuffer* buffer) const;
  absl::Status Failed(const std::string& what, const std::string& why) const {
    return absl::UnavailableError(
        absl::StrCat("camera ", options_.id, " (", options_.device, "): ", what, ": ", why));
  }
  void Close();
  void Abandon();
  bool Answers();
  std::optional<CameraDelivery> ReadClockWhereDue(Clock::time_point now);
  CameraDelivery Deliver(_ArvBuffer* buffer);
  absl::StatusOr<CameraDelivery> Reconnect(std::chrono::milliseconds timeout);
  void ReadStatistics();

  const GigeCameraOptions options_;
  Object<_ArvCamera> camera_;
  std::optional<GigeDevice> device_;
  std::unique_ptr<GigeStream> stream_;
  Object<_ArvChunkParser> chunks_;
  bool can_resend_ = false;
  Clock::time_point next_reading_, last_reading_;
  bool is_asked_before_reading_ = false;
  std::unique_ptr<GigePresence> presence_;
  std::atomic<bool> is_silent_ = false;
  bool has_told_of_times_ = false;
  std::string note_;  // to be delivered
  // Trigger, which comes from another thread, holds it while it uses device_; the thread that films, while it
  // replaces camera_ and device_, which it uses without it.
  TimedMutex device_mutex_;
  std::atomic<bool> is_lost_ = false;
  bool is_reported_lost_ = false;
  bool is_started_ = false;
  Clock::time_point next_attempt_, next_search_;
  Clock::time_point lost_since_;
  BlockIdUnwrapper unwrapper_;
  GigeStreamCounters counted_;  // of the stream, when last read
  mutable Mutex mutex_;
  std::map<std::string, std::string> settings_ ABSL_GUARDED_BY(mutex_);
  std::string clock_problem_ ABSL_GUARDED_BY(mutex_);
  CameraCounters counters_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
