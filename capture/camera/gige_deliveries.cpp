// What a GigE Vision camera delivers while it films, and how it is found again when it is gone.
#include <arv.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "base/mutex.h"
#include "capture/camera/gige_source.h"
#include "capture/camera/glib_error.h"

namespace weft {
namespace {

constexpr int64_t kVagueReading_ns = 1'000'000;  // a quiet network does better: the clock is read again soon
constexpr std::chrono::milliseconds kVagueReadingInterval{200};
constexpr std::chrono::milliseconds kAskedReadingInterval{100};  // at the shortest
constexpr std::chrono::seconds kSearchInterval{10};        // for a camera that its old address does not reach
constexpr std::chrono::milliseconds kLastAnswerWait{500};  // before a camera is told to stop

}  // namespace

void GigeCamera::ReadStatistics() {
  const GigeStreamCounters before = std::exchange(counted_, stream_->counters());
  const MutexLock lock(mutex_);
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
    delivery.cause = LossCause(status, counted_.packets_missing - missing, can_resend_, options_.resend);
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
    if (frame.device_time_ns == 0) {
      frame.device_time_ns = frame.host_time_ns;
      if (!std::exchange(has_told_of_times_, true))
        note_ = "its frames carry no time; their arrival times are used instead";
    }
  }
  const MutexLock lock(mutex_);
  ++(delivery.kind == CameraDelivery::Kind::kFrame ? counters_.frames : counters_.frames_lost);
  return delivery;
}

absl::StatusOr<CameraDelivery> GigeCamera::Reconnect(std::chrono::milliseconds timeout) {
  CameraDelivery delivery;
  if (!is_reported_lost_) {
    is_reported_lost_ = true;
    lost_since_ = Clock::now();
    next_attempt_ = lost_since_ + std::chrono::milliseconds(options_.reconnect_interval_ms);
    next_search_ = lost_since_ + kSearchInterval;
    {
      const MutexLock lock(device_mutex_);
      Abandon();
    }
    delivery.kind = CameraDelivery::Kind::kDisconnected;
    delivery.cause = "the camera no longer answers (unplugged, without power, or taken by another program)";
    const MutexLock lock(mutex_);
    ++counters_.disconnections;
    return delivery;
  }
  // Looking for cameras takes a second, and one at a time can do it: it must be worth it.
  static Mutex searching;
  const Clock::time_point now = Clock::now();
  presence_->Poll(now);
  const bool is_due = now >= next_attempt_ && (presence_->MayBeThere() || now >= next_search_);
  if (!is_due || !searching.try_lock()) {
    std::this_thread::sleep_for(timeout);
    return absl::DeadlineExceededError("the camera is disconnected");
  }
  const MutexLock searches(searching, std::adopt_lock);
  next_attempt_ = now + std::chrono::milliseconds(options_.reconnect_interval_ms);
  next_search_ = now + kSearchInterval;
  arv_update_device_list();
  const MutexLock lock(device_mutex_);
  absl::Status status = Open();
  if (status.ok()) status = Start();
  if (!status.ok()) return absl::DeadlineExceededError(status.message());
  is_reported_lost_ = false;
  delivery.kind = CameraDelivery::Kind::kReconnected;
  const auto away = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - lost_since_).count();
  delivery.cause = absl::StrCat("after ", away, " ms, with the same settings");
  return delivery;
}

// Only from a camera that has just answered: a request to one that is gone takes seconds to fail.
std::optional<CameraDelivery> GigeCamera::ReadClockWhereDue(Clock::time_point now) {
  if (options_.clock_interval_ms <= 0 || now < next_reading_ || !ClockProblem().empty()) return std::nullopt;
  if (!std::exchange(is_asked_before_reading_, true)) presence_->Ask(now);
  presence_->Poll(now);
  if (!presence_->MayBeThere()) return std::nullopt;
  is_asked_before_reading_ = false;
  last_reading_ = now;
  next_reading_ = now + std::chrono::milliseconds(options_.clock_interval_ms);
  const MutexLock lock(device_mutex_);
  absl::StatusOr<ClockReading> reading = device_->ReadClock();
  if (!reading.ok() || reading->uncertainty_ns > kVagueReading_ns)
    next_reading_ = std::min(next_reading_, Clock::now() + kVagueReadingInterval);
  if (!reading.ok()) return std::nullopt;
  CameraDelivery delivery;
  delivery.kind = CameraDelivery::Kind::kClock;
  delivery.clock = *std::move(reading);
  return delivery;
}

void GigeCamera::AskForClock() {
  next_reading_ = std::min(next_reading_, last_reading_ + kAskedReadingInterval);
}

absl::StatusOr<CameraDelivery> GigeCamera::Next(std::chrono::milliseconds timeout) {
  if (is_lost_ || is_reported_lost_) return Reconnect(timeout);
  if (!is_started_)
    return absl::FailedPreconditionError(absl::StrCat("camera ", options_.id, ": not started"));
  CameraDelivery delivery;
  if (!note_.empty()) {
    delivery.kind = CameraDelivery::Kind::kNote;
    delivery.cause = std::exchange(note_, "");
    return delivery;
  }
  if (std::optional<CameraDelivery> reading = ReadClockWhereDue(Clock::now())) return *std::move(reading);
  const GigeStream::Buffer buffer = stream_->Pop(timeout);
  const Clock::time_point now = Clock::now();
  if (buffer) {
    presence_->Heard(now);
    is_silent_ = false;
    return Deliver(buffer.get());
  }
  presence_->Poll(now);
  if (presence_->IsGone(now)) {
    is_lost_ = true;
    return Reconnect(timeout);
  }
  if (presence_->IsSilent(now) == is_silent_) return absl::DeadlineExceededError("no frame");
  is_silent_ = !is_silent_;
  delivery.kind = is_silent_ ? CameraDelivery::Kind::kSilent : CameraDelivery::Kind::kAnswers;
  return delivery;
}

bool GigeCamera::Answers() {
  if (is_lost_) return false;
  presence_->Ask(Clock::now());
  for (const auto end = Clock::now() + kLastAnswerWait; Clock::now() < end;) {
    presence_->Poll(Clock::now());
    if (presence_->MayBeThere()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  is_lost_ = true;
  return false;
}

}  // namespace weft
