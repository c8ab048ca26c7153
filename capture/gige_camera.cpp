#include "capture/gige_camera.h"

#include <arv.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/gige_device.h"
#include "capture/gige_stream.h"
#include "capture/glib_error.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int64_t kVagueReading_ns = 1'000'000;  // a quiet network does better: the clock is read again soon
constexpr std::chrono::milliseconds kVagueReadingInterval{200};

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <typename T>
using Object = std::unique_ptr<T, Unref>;

bool MayUsePacketSockets() {
  const int fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
  if (fd >= 0) close(fd);
  return fd >= 0;
}

class GigeCamera : public CameraSource {
 public:
  explicit GigeCamera(GigeCameraOptions options) : options_(std::move(options)) {}
  ~GigeCamera() override { Close(); }

  absl::Status Open();
  const std::string& camera_id() const override { return options_.id; }
  std::map<std::string, std::string> settings() const override {
    const std::lock_guard lock(mutex_);
    return settings_;
  }
  absl::Status Prepare() override { return OpenStream(); }
  absl::Status Start() override;
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds timeout) override;
  void Stop() override;
  bool TakesTriggers() const override { return options_.trigger.kind != TriggerKind::kFreeRun; }
  absl::Status Trigger() override;
  CameraCounters counters() const override {
    const std::lock_guard lock(mutex_);
    return counters_;
  }

 private:
  absl::Status Configure();
  absl::Status WaitForPtp();
  absl::Status OpenStream();
  void UsePacketSocket(bool use, const std::string& setting);
  int64_t DeviceTime_ns(ArvBuffer* buffer) const;
  std::string LossCause(ArvBufferStatus status, uint64_t missing_packets) const;
  absl::Status Failed(const std::string& what, const std::string& why) const {
    return absl::UnavailableError(
        absl::StrCat("camera ", options_.id, " (", options_.device, "): ", what, ": ", why));
  }
  void Close();
  CameraDelivery Deliver(ArvBuffer* buffer);
  absl::StatusOr<CameraDelivery> Reconnect(std::chrono::milliseconds timeout);
  void ReadStatistics();

  const GigeCameraOptions options_;
  Object<ArvCamera> camera_;
  std::optional<GigeDevice> device_;
  std::unique_ptr<GigeStream> stream_;
  Object<ArvChunkParser> chunks_;
  bool can_resend_ = false;
  Clock::time_point next_reading_;
  std::timed_mutex device_mutex_;  // of camera_ and device_: Trigger comes from another thread
  std::atomic<bool> is_lost_ = false;
  bool is_reported_lost_ = false;
  bool is_started_ = false;
  Clock::time_point next_attempt_;
  Clock::time_point lost_since_;
  BlockIdUnwrapper unwrapper_;
  GigeStreamCounters counted_;  // of the stream, when last read
  mutable std::mutex mutex_;
  std::map<std::string, std::string> settings_;
  CameraCounters counters_;
};

absl::Status GigeCamera::Configure() {
  for (const std::string& feature : options_.features)
    if (absl::Status status = device_->Set(feature); !status.ok()) return status;
  if (absl::Status status = device_->SetTrigger(options_.trigger); !status.ok()) return status;
  if (options_.fps > 0 && options_.trigger.kind == TriggerKind::kFreeRun) {
    GlibError error;
    arv_camera_set_frame_rate(camera_.get(), options_.fps, error.out());
    if (!error.ok())
      return Failed(absl::StrCat("it refuses ", options_.fps, " frames per second"), error.message());
  }
  if (options_.ptp)
    if (absl::Status status = device_->EnablePtp(); !status.ok()) return status;
  if (options_.chunk_timestamps) {
    GlibError error;
    arv_camera_set_chunks(camera_.get(), "Timestamp", error.out());
    if (!error.ok()) return Failed("it sends no ChunkTimestamp", error.message());
    chunks_.reset(arv_camera_create_chunk_parser(camera_.get()));
  }
  std::map<std::string, std::string> settings = device_->Describe(options_.features);
  can_resend_ = device_->CanResend();
  settings["PacketResend"] = !can_resend_ ? "the camera cannot" : options_.resend ? "on" : "off";
  GInetAddress* inet = g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(
      arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera_.get())))));
  const std::unique_ptr<char, decltype(&g_free)> text(g_inet_address_to_string(inet), &g_free);
  settings["DeviceAddress"] = text.get();
  const std::lock_guard lock(mutex_);
  settings_ = std::move(settings);
  return absl::OkStatus();
}

absl::Status GigeCamera::WaitForPtp() {
  const Clock::time_point end = Clock::now() + std::chrono::milliseconds(options_.ptp_wait_ms);
  while (!device_->HasPtpTime()) {
    if (Clock::now() >= end) {
      return absl::UnavailableError(
          absl::StrCat("camera ", options_.id, ": PTP is still in the state ", device_->PtpStatus(),
                       " after ", options_.ptp_wait_ms,
                       " ms; is there a PTP master in its network, and does the switch let PTP through?"));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const std::lock_guard lock(mutex_);
  settings_["PtpStatus"] = device_->PtpStatus();
  return absl::OkStatus();
}

absl::Status GigeCamera::Open() {
  Close();
  GlibError error;
  camera_.reset(arv_camera_new(options_.device.c_str(), error.out()));
  if (!camera_) {
    return absl::NotFoundError(absl::StrCat(
        "camera ", options_.id, ": no camera ", options_.device, " answers", error.ok() ? "" : " (",
        error.message(), error.ok() ? "" : ")", "; is it powered, in this network, and free?"));
  }
  if (!arv_camera_is_gv_device(camera_.get())) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", options_.id, ": ", options_.device, " is no GigE Vision camera"));
  }
  GlibError size_error;
  if (options_.packet_size_bytes > 0) {
    arv_camera_gv_set_packet_size(camera_.get(), options_.packet_size_bytes, size_error.out());
  } else {
    arv_camera_gv_auto_packet_size(camera_.get(), size_error.out());
  }
  if (!size_error.ok()) return Failed("its packet size cannot be set", size_error.message());
  is_lost_ = false;
  g_signal_connect(arv_camera_get_device(camera_.get()), "control-lost",
                   G_CALLBACK(+[](ArvDevice*, void* lost) { *static_cast<std::atomic<bool>*>(lost) = true; }),
                   &is_lost_);
  device_.emplace(options_.id, arv_camera_get_device(camera_.get()));
  if (absl::Status status = Configure(); !status.ok()) return status;
  // Aravis opens a packet socket first and tells it which packets are meant afterwards. In between it takes
  // those of every camera that films for this one's.
  if (is_reported_lost_) {
    UsePacketSocket(false, "off since the camera came back");
  } else {
    UsePacketSocket(options_.packet_socket, !options_.packet_socket ? "off"
                                            : MayUsePacketSockets() ? "on"
                                                                    : "not permitted");
  }
  return absl::OkStatus();
}

void GigeCamera::UsePacketSocket(bool use, const std::string& setting) {
  arv_camera_gv_set_stream_options(
      camera_.get(), use ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  const std::lock_guard lock(mutex_);
  settings_["PacketSocket"] = setting;
}

absl::Status GigeCamera::OpenStream() {
  std::string error;
  stream_ =
      GigeStream::Open(camera_.get(), {options_.resend, options_.retention_ms, options_.buffers}, error);
  if (!stream_) return Failed("its stream cannot be opened", error);
  unwrapper_.Reset();
  counted_ = {};
  return absl::OkStatus();
}

absl::Status GigeCamera::Start() {
  if (options_.ptp)
    if (absl::Status status = WaitForPtp(); !status.ok()) return status;
  // Packets before the camera was told to film are other programs'.
  if (stream_ && stream_->counters().packets_received > 0) {
    UsePacketSocket(false, "off, since it took in other programs' packets");
    stream_.reset();
  }
  if (!stream_)
    if (absl::Status status = OpenStream(); !status.ok()) return status;
  GlibError error;
  arv_camera_start_acquisition(camera_.get(), error.out());
  if (!error.ok()) return Failed("it does not start", error.message());
  is_started_ = true;
  return absl::OkStatus();
}

void GigeCamera::ReadStatistics() {
  const GigeStreamCounters before = std::exchange(counted_, stream_->counters());
  const std::lock_guard lock(mutex_);
  counters_.packets_resent += counted_.packets_resent - before.packets_resent;
  counters_.packets_missing += counted_.packets_missing - before.packets_missing;
}

int64_t GigeCamera::DeviceTime_ns(ArvBuffer* buffer) const {
  if (chunks_ && arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS) {
    GlibError error;
    const gint64 time_ns =
        arv_chunk_parser_get_integer_value(chunks_.get(), buffer, "ChunkTimestamp", error.out());
    if (error.ok()) return time_ns;
  }
  return static_cast<int64_t>(arv_buffer_get_timestamp(buffer));
}

std::string GigeCamera::LossCause(ArvBufferStatus status, uint64_t missing_packets) const {
  std::string cause = LossInWords(status);
  if (missing_packets == 0) return cause;
  const char* resend = !can_resend_      ? "the camera cannot resend them"
                       : options_.resend ? "asked for again in vain"
                                         : "resend is off";
  absl::StrAppend(&cause, ": ", missing_packets, " packets, ", resend);
  return cause;
}

CameraDelivery GigeCamera::Deliver(ArvBuffer* buffer) {
  CameraDelivery delivery;
  RawFrame& frame = delivery.frame;
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  frame.camera_id = options_.id;
  frame.host_time_ns = static_cast<int64_t>(arv_buffer_get_system_timestamp(buffer));
  frame.device_time_ns = DeviceTime_ns(buffer);
  frame.device_frame_id = unwrapper_.Unwrap(arv_buffer_get_frame_id(buffer));
  const uint64_t missing = counted_.packets_missing;
  ReadStatistics();
  delivery.kind = CameraDelivery::Kind::kLostFrame;
  if (status != ARV_BUFFER_STATUS_SUCCESS) {
    delivery.cause = LossCause(status, counted_.packets_missing - missing);
  } else {
    frame.width_px = arv_buffer_get_image_width(buffer);
    frame.height_px = arv_buffer_get_image_height(buffer);
    frame.format = static_cast<RawFormat>(arv_buffer_get_image_pixel_format(buffer));
    const std::shared_ptr<AlignedBuffer> memory = MemoryOf(buffer);
    const uint64_t expected = RawBytes(frame.format, frame.width_px, frame.height_px);
    if (expected > 0 && expected < memory->size()) memory->Shrink(expected);  // chunk data follow the image
    frame.bytes = memory;
    const absl::Status valid = frame.Validate();
    if (valid.ok()) delivery.kind = CameraDelivery::Kind::kFrame;
    delivery.cause = std::string(valid.message());
  }
  const std::lock_guard lock(mutex_);
  ++(delivery.kind == CameraDelivery::Kind::kFrame ? counters_.frames : counters_.frames_lost);
  return delivery;
}

absl::StatusOr<CameraDelivery> GigeCamera::Reconnect(std::chrono::milliseconds timeout) {
  CameraDelivery delivery;
  if (!is_reported_lost_) {
    is_reported_lost_ = true;
    lost_since_ = Clock::now();
    next_attempt_ = lost_since_;
    {
      const std::lock_guard lock(device_mutex_);
      Close();
    }
    delivery.kind = CameraDelivery::Kind::kDisconnected;
    delivery.cause = "the camera no longer answers (unplugged, without power, or taken by another program)";
    const std::lock_guard lock(mutex_);
    ++counters_.disconnections;
    return delivery;
  }
  if (Clock::now() < next_attempt_) {
    std::this_thread::sleep_for(std::min<Clock::duration>(timeout, next_attempt_ - Clock::now()));
    return absl::DeadlineExceededError("the camera is disconnected");
  }
  next_attempt_ = Clock::now() + std::chrono::milliseconds(options_.reconnect_interval_ms);
  arv_update_device_list();
  const std::lock_guard lock(device_mutex_);
  absl::Status status = Open();
  if (status.ok()) status = Start();
  if (!status.ok()) return absl::DeadlineExceededError(status.message());
  is_reported_lost_ = false;
  delivery.kind = CameraDelivery::Kind::kReconnected;
  const auto away = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - lost_since_).count();
  delivery.cause = absl::StrCat("after ", away, " ms, with the same settings");
  return delivery;
}

absl::StatusOr<CameraDelivery> GigeCamera::Next(std::chrono::milliseconds timeout) {
  if (is_lost_ || is_reported_lost_) return Reconnect(timeout);
  if (!is_started_)
    return absl::FailedPreconditionError(absl::StrCat("camera ", options_.id, ": not started"));
  if (options_.clock_interval_ms > 0 && Clock::now() >= next_reading_) {
    next_reading_ = Clock::now() + std::chrono::milliseconds(options_.clock_interval_ms);
    const std::lock_guard lock(device_mutex_);
    absl::StatusOr<ClockReading> reading = device_->ReadClock();
    if (!reading.ok() || reading->uncertainty_ns > kVagueReading_ns)
      next_reading_ = std::min(next_reading_, Clock::now() + kVagueReadingInterval);
    if (reading.ok()) {
      CameraDelivery delivery;
      delivery.kind = CameraDelivery::Kind::kClock;
      delivery.clock = *std::move(reading);
      return delivery;
    }
  }
  const GigeStream::Buffer buffer = stream_->Pop(timeout);
  if (!buffer) return absl::DeadlineExceededError("no frame");
  return Deliver(buffer.get());
}

absl::Status GigeCamera::Trigger() {
  const std::unique_lock lock(device_mutex_, std::chrono::milliseconds(20));
  if (!lock || is_lost_ || !is_started_)
    return absl::UnavailableError(absl::StrCat("camera ", options_.id, ": not connected"));
  return device_->Execute("TriggerSoftware");
}

void GigeCamera::Stop() {
  if (!camera_ || !is_started_) return;
  is_started_ = false;
  GlibError error;
  arv_camera_stop_acquisition(camera_.get(), error.out());
  ReadStatistics();
}

void GigeCamera::Close() {
  if (camera_ && !is_lost_) Stop();
  is_started_ = false;
  if (camera_) {
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &is_lost_);
  }
  stream_.reset();
  chunks_.reset();
  device_.reset();
  camera_.reset();
}

}  // namespace

absl::Status GigeCameraOptions::Validate() const {
  if (id.empty() || device.empty())
    return absl::InvalidArgumentError("a GigE Vision camera needs an id and a device");
  if (buffers < 2)
    return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": buffers must be at least 2"));
  if (!(fps >= 0))
    return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": fps must not be negative"));
  if (clock_interval_ms < 0 || ptp_wait_ms < 0 || retention_ms <= 0)
    return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": waits must not be negative"));
  for (const std::string& feature : features) {
    if (feature.find('=') == std::string::npos || feature.front() == '=')
      return absl::InvalidArgumentError(
          absl::StrCat("camera ", id, ": feature \"", feature, "\" is not of the form Name=value"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<CameraSource>> OpenGigeCamera(const GigeCameraOptions& options) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  auto camera = std::make_unique<GigeCamera>(options);
  if (absl::Status status = camera->Open(); !status.ok()) return status;
  return camera;
}

}  // namespace weft
