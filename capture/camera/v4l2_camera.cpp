#include "capture/camera/v4l2_camera.h"

#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/camera/v4l2_ioctl.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;
constexpr uint64_t kMostLosses = 1024;  // told one by one after a gap

ClockReading ReadMonotonic() {
  const int64_t before_ns = HostTime_ns();
  const int64_t monotonic_ns = MonotonicTime_ns();
  const int64_t after_ns = HostTime_ns();
  ClockReading reading;
  reading.host_time_ns = before_ns + (after_ns - before_ns) / 2;
  reading.device_minus_host_ns = monotonic_ns - reading.host_time_ns;
  reading.uncertainty_ns = std::max<int64_t>(1000, (after_ns - before_ns) / 2);
  return reading;
}

class V4l2Camera : public CameraSource {
 public:
  explicit V4l2Camera(V4l2CameraOptions options) : options_(std::move(options)) {}

  absl::Status Open(const std::string& device);
  const std::string& camera_id() const override { return options_.id; }
  std::map<std::string, std::string> settings() const override {
    const MutexLock lock(mutex_);
    return settings_;
  }
  absl::Status Start() override;
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds timeout) override;
  void Stop() override { stream_.reset(); }
  bool TakesTriggers() const override { return false; }
  CameraCounters counters() const override {
    const MutexLock lock(mutex_);
    return counters_;
  }

 private:
  absl::Status Configure();
  void Describe();
  CameraDelivery Lose(const std::string& cause);
  absl::StatusOr<CameraDelivery> Reconnect(std::chrono::milliseconds timeout);
  absl::Status OpenAgain();
  absl::StatusOr<CameraDelivery> ReadEvents();
  CameraDelivery Deliver(V4l2Filled filled);
  void AddGap(uint64_t next_id, int64_t next_time_ns);
  std::string GapCause(uint64_t id) const;
  CameraDelivery TakePending();

  const V4l2CameraOptions options_;
  std::optional<V4l2Device> device_;
  std::optional<V4l2Identity> identity_;  // of the camera that was opened first
  V4l2Image image_;
  std::unique_ptr<V4l2Stream> stream_;
  std::deque<CameraDelivery> pending_;
  bool is_lost_ = false;
  Clock::time_point lost_since_, next_attempt_, next_reading_;
  Clock::time_point last_taken_;        // when the driver last had our attention
  Clock::duration pause_ = {};          // the longest between two such times since the last frame
  std::deque<Clock::duration> pauses_;  // before each of the last frames, of which full buffers held all
  SequenceUnwrapper unwrapper_;
  std::optional<uint64_t> last_id_;
  int64_t last_time_ns_ = 0;
  mutable Mutex mutex_;
  std::map<std::string, std::string> settings_ ABSL_GUARDED_BY(mutex_);
  CameraCounters counters_ ABSL_GUARDED_BY(mutex_);
};

absl::Status V4l2Camera::Open(const std::string& device) {
  stream_.reset();
  device_.reset();
  WEFT_ASSIGN_OR_RETURN(V4l2Device opened, V4l2Device::Open(options_.id, device));
  device_.emplace(std::move(opened));
  const V4l2Identity& found = device_->identity();
  if (!identity_) identity_ = found;
  if (found.card != identity_->card || found.serial != identity_->serial)
    return absl::NotFoundError(absl::StrCat("camera ", options_.id, ": at ", device,
                                            " is now another camera, ", found.card, " ", found.serial));
  return Configure();
}

absl::Status V4l2Camera::Configure() {
  WEFT_ASSIGN_OR_RETURN(const V4l2Image image,
                        device_->SetImage(options_.format, options_.width_px, options_.height_px));
  image_ = image;
  if (options_.fps > 0) WEFT_RETURN_IF_ERROR(device_->SetRate(options_.fps));
  for (const std::string& control : options_.controls) WEFT_RETURN_IF_ERROR(device_->SetControl(control));
  for (const std::string& control : options_.controls) device_->WatchControl(control);
  device_->WatchSource();
  Describe();
  return absl::OkStatus();
}

void V4l2Camera::Describe() {
  std::map<std::string, std::string> settings = device_->ControlValues();
  const V4l2Identity& identity = device_->identity();
  settings["DeviceModelName"] = identity.card;
  settings["DeviceSerialNumber"] = identity.serial;
  settings["Driver"] = identity.driver;
  settings["Bus"] = identity.bus;
  settings["Path"] = identity.path;
  settings["PixelFormat"] = std::string(RawFormatName(image_.format));
  settings["Width"] = absl::StrCat(image_.width_px);
  settings["Height"] = absl::StrCat(image_.height_px);
  if (const double rate = device_->Rate(); rate > 0)
    settings["AcquisitionFrameRate"] = absl::StrFormat("%g", rate);
  settings["Buffers"] = options_.memory == V4l2Memory::kMmap ? "of the driver" : "of the program";
  if (stream_)
    settings["Timestamps"] = !stream_->has_times()           ? "of arrival"
                             : stream_->has_exposure_times() ? "of the start of the exposure"
                                                             : "of the end of the frame";
  const MutexLock lock(mutex_);
  settings_ = std::move(settings);
}

absl::Status V4l2Camera::Start() {
  auto stream = V4l2Stream::Start(*device_, image_, options_.memory, options_.buffers);
  if (!stream.ok()) {
    return {stream.status().code(), absl::StrCat("camera ", options_.id, " (", device_->identity().path,
                                                 "): ", stream.status().message())};
  }
  stream_ = *std::move(stream);
  unwrapper_.Reset();
  last_id_.reset();
  last_taken_ = Clock::now();
  pause_ = {};
  pauses_.clear();
  Describe();
  return absl::OkStatus();
}

CameraDelivery V4l2Camera::Lose(const std::string& cause) {
  is_lost_ = true;
  lost_since_ = next_attempt_ = Clock::now();
  stream_.reset();
  device_.reset();
  CameraDelivery delivery;
  delivery.kind = CameraDelivery::Kind::kDisconnected;
  delivery.cause = cause;
  const MutexLock lock(mutex_);
  ++counters_.disconnections;
  return delivery;
}

// A camera that comes back may have another path.
absl::Status V4l2Camera::OpenAgain() {
  absl::Status status = Open(identity_->bus);
  if (!status.ok()) status = Open(options_.device);
  if (status.ok()) status = Start();
  return status;
}

absl::StatusOr<CameraDelivery> V4l2Camera::Reconnect(std::chrono::milliseconds timeout) {
  if (Clock::now() < next_attempt_) {
    std::this_thread::sleep_for(std::min<Clock::duration>(timeout, next_attempt_ - Clock::now()));
    return absl::DeadlineExceededError("the camera is disconnected");
  }
  next_attempt_ = Clock::now() + std::chrono::milliseconds(options_.reconnect_interval_ms);
  if (absl::Status status = OpenAgain(); !status.ok()) return absl::DeadlineExceededError(status.message());
  is_lost_ = false;
  CameraDelivery delivery;
  delivery.kind = CameraDelivery::Kind::kReconnected;
  const auto away = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - lost_since_).count();
  delivery.cause = absl::StrCat("after ", away, " ms, with the same settings");
  return delivery;
}

// What happened to the camera besides frames.
absl::StatusOr<CameraDelivery> V4l2Camera::ReadEvents() {
  v4l2_event event{};
  if (V4l2Ioctl(device_->fd(), VIDIOC_DQEVENT, &event) != 0) return absl::DeadlineExceededError("no event");
  if (event.type == V4L2_EVENT_SOURCE_CHANGE)
    return Lose("its source changed (another signal or resolution); the stream begins anew");
  CameraDelivery delivery;
  delivery.kind = CameraDelivery::Kind::kNote;
  if (event.type == V4L2_EVENT_CTRL && (event.u.ctrl.changes & V4L2_EVENT_CTRL_CH_VALUE) != 0)
    delivery.cause = absl::StrCat("another program or the camera itself set its control ",
                                  device_->ControlName(event.id), " to ", event.u.ctrl.value);
  if (delivery.cause.empty()) return absl::DeadlineExceededError("no event for the ledger");
  return delivery;
}

std::string V4l2Camera::GapCause(uint64_t id) const {
  const double rate = device_->Rate();
  const double pause_s =
      std::chrono::duration<double>(*std::max_element(pauses_.begin(), pauses_.end())).count();
  const std::string start = absl::StrCat("the driver counted frame ", id, " and did not deliver it: ");
  if (rate > 0 && pause_s * rate > stream_->buffers() - 1)
    return absl::StrFormat("%sall %d buffers were full, since the host was busy for %.0f ms", start,
                           stream_->buffers(), 1e3 * pause_s);
  return start + "dropped by the camera, its bus or its driver";
}

void V4l2Camera::AddGap(uint64_t next_id, int64_t next_time_ns) {
  if (!last_id_ || next_id <= *last_id_ + 1) return;
  const uint64_t steps = next_id - *last_id_;
  for (uint64_t i = 1; i < std::min(steps, kMostLosses); ++i) {
    CameraDelivery lost;
    lost.kind = CameraDelivery::Kind::kLostFrame;
    lost.frame.camera_id = options_.id;
    lost.frame.device_frame_id = *last_id_ + i;
    lost.frame.device_time_ns = last_time_ns_ + (next_time_ns - last_time_ns_) / static_cast<int64_t>(steps) *
                                                    static_cast<int64_t>(i);
    lost.cause = GapCause(*last_id_ + i);
    pending_.push_back(std::move(lost));
  }
}

CameraDelivery V4l2Camera::Deliver(V4l2Filled filled) {
  CameraDelivery delivery;
  RawFrame& frame = delivery.frame;
  frame.camera_id = options_.id;
  frame.device_time_ns = filled.monotonic_ns;
  frame.host_time_ns = HostTime_ns();
  frame.device_frame_id = unwrapper_.Unwrap(filled.sequence);
  frame.width_px = image_.width_px;
  frame.height_px = image_.height_px;
  frame.format = image_.format;
  pauses_.push_front(std::exchange(pause_, {}));
  if (pauses_.size() > static_cast<size_t>(stream_->buffers()) + 1) pauses_.pop_back();
  AddGap(frame.device_frame_id, frame.device_time_ns);
  last_id_ = frame.device_frame_id;
  last_time_ns_ = frame.device_time_ns;
  delivery.cause = std::move(filled.fault);
  if (delivery.cause.empty()) {
    frame.bytes = std::move(filled.bytes);
    delivery.cause = std::string(frame.Validate().message());
  }
  delivery.kind = delivery.cause.empty() ? CameraDelivery::Kind::kFrame : CameraDelivery::Kind::kLostFrame;
  pending_.push_back(std::move(delivery));
  return TakePending();
}

CameraDelivery V4l2Camera::TakePending() {
  CameraDelivery delivery = std::move(pending_.front());
  pending_.pop_front();
  const MutexLock lock(mutex_);
  counters_.frames += delivery.kind == CameraDelivery::Kind::kFrame ? 1 : 0;
  counters_.frames_lost += delivery.kind == CameraDelivery::Kind::kLostFrame ? 1 : 0;
  return delivery;
}

absl::StatusOr<CameraDelivery> V4l2Camera::Next(std::chrono::milliseconds timeout) {
  if (!pending_.empty()) return TakePending();
  if (is_lost_) return Reconnect(timeout);
  if (!stream_) return absl::FailedPreconditionError(absl::StrCat("camera ", options_.id, ": not started"));
  if (options_.clock_interval_ms > 0 && Clock::now() >= next_reading_) {
    next_reading_ = Clock::now() + std::chrono::milliseconds(options_.clock_interval_ms);
    CameraDelivery delivery;
    delivery.kind = CameraDelivery::Kind::kClock;
    delivery.clock = ReadMonotonic();
    return delivery;
  }
  pause_ = std::max(pause_, Clock::now() - last_taken_);
  pollfd ready{device_->fd(), POLLIN | POLLPRI, 0};
  const int count = poll(&ready, 1, static_cast<int>(timeout.count()));
  last_taken_ = Clock::now();
  if (count <= 0) return absl::DeadlineExceededError("no frame");
  if ((ready.revents & POLLPRI) != 0) {
    absl::StatusOr<CameraDelivery> told = ReadEvents();
    if (told.ok() || (ready.revents & (POLLIN | POLLERR)) == 0) return told;
  }
  absl::StatusOr<V4l2Filled> filled = stream_->Next();
  if (absl::IsUnavailable(filled.status())) return Lose(std::string(filled.status().message()));
  if (!filled.ok() && (ready.revents & POLLERR) != 0)
    return Lose("the driver reports an error of the stream");
  if (!filled.ok()) return filled.status();
  return Deliver(*std::move(filled));
}

}  // namespace

absl::Status V4l2CameraOptions::Validate() const {
  if (id.empty() || device.empty())
    return absl::InvalidArgumentError("a V4L2 camera needs an id and a device");
  const auto fault = [&](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": ", what));
  };
  if (width_px < 0 || height_px < 0) return fault("width_px and height_px must not be negative");
  if (!(fps >= 0)) return fault("fps must not be negative");
  if (buffers < 2 || buffers > 32) return fault("buffers must be 2 to 32");
  if (clock_interval_ms < 0) return fault("clock_interval_ms must not be negative");
  for (const std::string& control : controls)
    if (control.empty() || control.front() == '=') return fault("a control is not of the form Name=value");
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<CameraSource>> OpenV4l2Camera(const V4l2CameraOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  auto camera = std::make_unique<V4l2Camera>(options);
  WEFT_RETURN_IF_ERROR(camera->Open(options.device));
  return camera;
}

}  // namespace weft
