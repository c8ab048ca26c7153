#include "capture/camera/gige_camera.h"

#include <arpa/inet.h>
#include <arv.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "capture/camera/gige_discovery.h"
#include "capture/camera/gige_source.h"
#include "capture/camera/glib_error.h"

namespace weft {
namespace {

bool MayUsePacketSockets() {
  const int fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
  if (fd >= 0) close(fd);
  return fd >= 0;
}

}  // namespace

namespace {

// ", it delivers up to 900"; empty where the camera does not say.
std::string FastestRate(ArvCamera* camera) {
  GlibError error;
  double least = 0, most = 0;
  arv_camera_get_frame_rate_bounds(camera, &least, &most, error.out());
  return error.ok() && most > 0 && most < 1e6 ? absl::StrFormat(", it delivers up to %.6g", most) : "";
}

// Aravis knows cameras by address, MAC, name and vendor with serial number. The address of a camera of this
// serial number; empty where none has it, InvalidArgument where several do.
absl::StatusOr<std::string> AddressOfSerial(const std::string& id, const std::string& serial) {
  in_addr address{};
  if (inet_pton(AF_INET, serial.c_str(), &address) == 1) return "";
  for (const bool is_fresh : {false, true}) {
    std::vector<std::string> addresses;
    for (const FoundCamera& camera : is_fresh ? FindGigeCameras() : KnownGigeCameras())
      if (camera.serial == serial) addresses.push_back(camera.address);
    if (addresses.size() == 1) return addresses[0];
    if (addresses.size() > 1)
      return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": the serial number ", serial,
                                                     " is that of ", absl::StrJoin(addresses, " and "),
                                                     "; give an address as `device`"));
    if (IsKnownToAravis(serial)) return "";
  }
  return "";
}

}  // namespace

void UnrefGObject::operator()(void* object) const { g_object_unref(object); }

// A camera may take the rate that it can without a word.
absl::Status GigeCamera::CheckRate() {
  GlibError error;
  const double fps = arv_camera_get_frame_rate(camera_.get(), error.out());
  constexpr double kRounding = 0.01;
  if (!error.ok() || fps <= 0 || std::abs(fps / options_.fps - 1) <= kRounding) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("camera %s (%s): it delivers %.6g frames per second, and `fps` of the session is %.6g; "
                      "give a rate that it has, or a shorter exposure or a smaller image",
                      options_.id, options_.device, fps, options_.fps));
}

absl::Status GigeCamera::Configure() {
  for (const std::string& feature : options_.features) WEFT_RETURN_IF_ERROR(device_->Set(feature));
  WEFT_RETURN_IF_ERROR(device_->SetTrigger(options_.trigger));
  if (options_.fps > 0 && options_.trigger.kind == TriggerKind::kFreeRun) {
    GlibError error;
    arv_camera_set_frame_rate(camera_.get(), options_.fps, error.out());
    if (!error.ok())
      return Failed(absl::StrCat("it refuses ", options_.fps, " frames per second"),
                    error.message() + FastestRate(camera_.get()));
    WEFT_RETURN_IF_ERROR(CheckRate());
  }
  if (options_.ptp) WEFT_RETURN_IF_ERROR(device_->EnablePtp());
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
  presence_ = std::make_unique<GigePresence>(text.get());
  std::string clock_problem = device_->ClockProblem();
  if (!clock_problem.empty()) settings["Clock"] = "cannot be read: " + clock_problem;
  const MutexLock lock(mutex_);
  settings_ = std::move(settings);
  clock_problem_ = std::move(clock_problem);
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
  const MutexLock lock(mutex_);
  settings_["PtpStatus"] = device_->PtpStatus();
  return absl::OkStatus();
}

// A camera lets go of a program that died once its heartbeat is missing, after 3 s by default.
absl::Status GigeCamera::TakeControl() {
  ArvGvDevice* device = ARV_GV_DEVICE(arv_camera_get_device(camera_.get()));
  const Clock::time_point end =
      Clock::now() + (is_reported_lost_ ? std::chrono::seconds(0) : std::chrono::seconds(4));
  while (!arv_gv_device_is_controller(device)) {
    if (Clock::now() >= end) {
      return absl::FailedPreconditionError(absl::StrCat("camera ", options_.id, ": another program controls ",
                                                        options_.device,
                                                        ", or another camera of the session is the same "
                                                        "device; stop that program, or correct `device`"));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    GlibError error;
    arv_gv_device_take_control(device, error.out());
  }
  return absl::OkStatus();
}

absl::Status GigeCamera::Open() {
  Close();
  GlibError error;
  WEFT_ASSIGN_OR_RETURN(const std::string address, AddressOfSerial(options_.id, options_.device));
  const std::string& device = address.empty() ? options_.device : address;
  camera_.reset(arv_camera_new(device.c_str(), error.out()));
  if (!camera_) {
    return absl::NotFoundError(absl::StrCat(
        "camera ", options_.id, ": no camera ", options_.device, " answers", error.ok() ? "" : " (",
        error.message(), error.ok() ? "" : ")", "; is it powered, in this network, and free?"));
  }
  if (!arv_camera_is_gv_device(camera_.get())) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", options_.id, ": ", options_.device, " is no GigE Vision camera"));
  }
  WEFT_RETURN_IF_ERROR(TakeControl());
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
  WEFT_RETURN_IF_ERROR(Configure());
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
  const MutexLock lock(mutex_);
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
  if (options_.ptp) WEFT_RETURN_IF_ERROR(WaitForPtp());
  // Packets before the camera was told to film are other programs'.
  if (stream_ && stream_->counters().packets_received > 0) {
    UsePacketSocket(false, "off, since it took in other programs' packets");
    stream_.reset();
  }
  if (!stream_) WEFT_RETURN_IF_ERROR(OpenStream());
  GlibError error;
  arv_camera_start_acquisition(camera_.get(), error.out());
  if (!error.ok()) return Failed("it does not start", error.message());
  is_started_ = true;
  is_silent_ = false;
  presence_->Heard(Clock::now());
  return absl::OkStatus();
}

absl::Status GigeCamera::Trigger() {
  const absl::Status away = absl::UnavailableError(absl::StrCat("camera ", options_.id, ": not connected"));
  if (!device_mutex_.try_lock_for(std::chrono::milliseconds(20))) return away;
  const MutexLock lock(device_mutex_, std::adopt_lock);
  if (is_lost_ || is_silent_ || !is_started_) return away;
  return device_->Execute("TriggerSoftware");
}

void GigeCamera::Stop() {
  if (!camera_ || !is_started_) return;
  is_started_ = false;
  GlibError error;
  if (Answers()) arv_camera_stop_acquisition(camera_.get(), error.out());
  ReadStatistics();
}

void GigeCamera::Close() {
  if (camera_ && !is_lost_) Stop();
  if (is_lost_) return Abandon();
  is_started_ = false;
  if (camera_) {
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &is_lost_);
  }
  stream_.reset();
  chunks_.reset();
  device_.reset();
  camera_.reset();
}

// Aravis takes seconds to take leave of a camera that does not answer: nobody waits for that.
void GigeCamera::Abandon() {
  is_started_ = false;
  device_.reset();
  if (!camera_) return;
  g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &is_lost_);
  std::thread([stream = std::move(stream_), chunks = std::move(chunks_),
               camera = std::move(camera_)]() mutable {
    stream.reset();
    chunks.reset();
    camera.reset();
  }).detach();
}

absl::StatusOr<std::unique_ptr<CameraSource>> OpenGigeCamera(const GigeCameraOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  auto camera = std::make_unique<GigeCamera>(options);
  WEFT_RETURN_IF_ERROR(camera->Open());
  return camera;
}

}  // namespace weft
