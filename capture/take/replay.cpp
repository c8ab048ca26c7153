#include "capture/take/replay.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

class ReplayCamera : public CameraSource {
 public:
  ReplayCamera(std::shared_ptr<Replay> replay, size_t camera)
      : replay_(std::move(replay)),
        camera_(camera),
        id_(replay_->view().take().camera_ids()[camera]),
        time_ns_(replay_->SetTime_ns(0)) {}

  const std::string& camera_id() const override { return id_; }
  std::map<std::string, std::string> settings() const override;
  absl::Status Start() override { return absl::OkStatus(); }
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds timeout) override;
  void Stop() override {}
  absl::Status Trigger() override {
    replay_->clock().Step();
    return absl::OkStatus();
  }
  CameraCounters counters() const override {
    CameraCounters counters;
    counters.frames = frames_;
    counters.frames_lost = lost_;
    return counters;
  }

 private:
  // When the camera took the frame of this set that it lost, by its own clock: a period for every set since
  // its last frame. 0 where none came before.
  int64_t LostTime_ns(uint64_t set) const;

  const std::shared_ptr<Replay> replay_;
  const size_t camera_;
  const std::string id_;
  size_t next_ = 0;
  int64_t time_ns_;  // of the frame before
  struct LastFrame {
    uint64_t set = 0;
    int64_t device_time_ns = 0;
  };
  std::optional<LastFrame> last_;
  std::atomic<uint64_t> frames_ = 0, lost_ = 0;
};

std::map<std::string, std::string> ReplayCamera::settings() const {
  std::map<std::string, std::string> settings = {{"DeviceModelName", "replay"}};
  const StreamReader& stream = replay_->view().take().stream(camera_);
  for (const IndexRecord& record : stream.records()) {
    if (record.is_missing) continue;
    const absl::StatusOr<ChunkHeader> header = stream.ReadHeader(record);
    if (!header.ok()) break;
    settings["PixelFormat"] = std::string(RawFormatName(header->format));
    settings["Width"] = absl::StrCat(header->width_px);
    settings["Height"] = absl::StrCat(header->height_px);
    break;
  }
  return settings;
}

int64_t ReplayCamera::LostTime_ns(uint64_t set) const {
  if (!last_) return 0;
  return last_->device_time_ns + replay_->period_ns() * static_cast<int64_t>(set - last_->set);
}

absl::StatusOr<CameraDelivery> ReplayCamera::Next(std::chrono::milliseconds timeout) {
  const TakeView& view = replay_->view();
  if (next_ == view.sets().size()) return absl::OutOfRangeError("the recorded take ends here");
  const int64_t time_ns = view.Time_ns(next_, camera_).value_or(time_ns_);
  if (!replay_->clock().WaitFor(time_ns, next_, timeout))
    return absl::DeadlineExceededError("the next frame is not due yet");
  time_ns_ = time_ns;
  const uint64_t set = view.sets()[next_];
  absl::StatusOr<RawFrame> frame = view.ReadRaw(next_++, camera_);
  CameraDelivery delivery;
  if (frame.ok()) {
    ++frames_;
    last_ = {set, frame->device_time_ns};
    delivery.frame = *std::move(frame);
    return delivery;
  }
  ++lost_;
  delivery.kind = CameraDelivery::Kind::kLostFrame;
  delivery.frame.device_time_ns = LostTime_ns(set);
  delivery.cause = std::string(frame.status().message());
  return delivery;
}

}  // namespace

absl::Status ReplayOptions::Validate() const {
  if (std::isfinite(speed) && speed > 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the speed of a replay must be positive, not ", speed));
}

ReplayClock::Clock::time_point ReplayClock::DueAt(int64_t time_ns) const {
  const double after_ns = static_cast<double>(time_ns - begin_ns_) / speed_;
  return *start_ + std::chrono::nanoseconds(std::llround(after_ns));
}

bool ReplayClock::WaitFor(int64_t time_ns, size_t index, std::chrono::nanoseconds timeout) {
  MutexLock lock(mutex_);
  if (!start_) start_ = Clock::now();
  if (mode_ == ReplayMode::kFastest) return true;
  if (mode_ == ReplayMode::kStepwise) {
    return stepped_.wait_for(lock, timeout,
                             [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return index < steps_; });
  }
  const Clock::time_point due = DueAt(time_ns), end = Clock::now() + timeout;
  lock.unlock();
  std::this_thread::sleep_until(std::min(due, end));
  return due <= end;
}

void ReplayClock::Step() {
  const MutexLock lock(mutex_);
  ++steps_;
  stepped_.notify_all();
}

std::chrono::nanoseconds ReplayClock::Lateness(int64_t time_ns) const {
  const MutexLock lock(mutex_);
  if (mode_ != ReplayMode::kPaced || !start_) return std::chrono::nanoseconds(0);
  return std::max(Clock::now() - DueAt(time_ns), Clock::duration(0));
}

Replay::Replay(TakeView view, std::vector<int64_t> set_times_ns, const ReplayOptions& options)
    : view_(std::move(view)),
      set_times_ns_(std::move(set_times_ns)),
      period_ns_(PeriodOf_ns(view_.take())),
      clock_(options, set_times_ns_.front()) {}

absl::StatusOr<std::shared_ptr<Replay>> Replay::Open(const std::string& folder,
                                                     const ReplayOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(TakeView view, TakeView::Open(folder, options.view));
  std::vector<int64_t> times_ns(view.sets().size(), 0);
  std::optional<int64_t> before_ns;
  for (size_t i = 0; i < times_ns.size(); ++i) {
    std::optional<int64_t> last_ns;
    for (size_t camera = 0; camera < view.take().camera_ids().size(); ++camera)
      last_ns = std::max(last_ns, view.Time_ns(i, camera));
    if (last_ns && !before_ns) std::fill_n(times_ns.begin(), i, *last_ns);
    if (last_ns) before_ns = last_ns;
    times_ns[i] = before_ns.value_or(0);
  }
  return std::shared_ptr<Replay>(new Replay(std::move(view), std::move(times_ns), options));
}

absl::StatusOr<std::unique_ptr<CameraSource>> OpenReplayCamera(std::shared_ptr<Replay> replay,
                                                               const std::string& id) {
  const std::vector<std::string>& ids = replay->view().take().camera_ids();
  const auto at = std::find(ids.begin(), ids.end(), id);
  if (at == ids.end()) return absl::NotFoundError(absl::StrCat("the recorded take has no camera ", id));
  return std::make_unique<ReplayCamera>(std::move(replay), static_cast<size_t>(at - ids.begin()));
}

}  // namespace weft
