#include "services/work/animation/camera_feed.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <thread>
#include <utility>
#include <vector>

#include "base/host_clock.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/take/recorded_take.h"
#include "services/studio/recording/session_file.h"
#include "services/work/animation/set_in_memory.h"

namespace weft {
namespace {

// A look at the stop token of whoever waits.
constexpr std::chrono::milliseconds kStopPeriod{50};

class FilmedFrames : public CameraFeed {
 public:
  FilmedFrames(std::vector<std::unique_ptr<CameraSource>> cameras, LiveRecordingOptions options,
               std::string take, Rig rig, double fps)
      : cameras_(std::move(cameras)),
        options_(std::move(options)),
        rig_(std::move(rig)),
        interval_ns_(std::max<int64_t>(1, std::llround(1e9 / fps))) {
    options_.look = [this](const RawFrameSet& set) { Offer(set); };
    recording_ = std::thread([this, folder = std::move(take)] {
      absl::StatusOr<v1::Take> outcome = RecordLive(folder, cameras_, options_, stopping_);
      const MutexLock lock(mutex_);
      outcome_ = std::move(outcome);
      has_ended_ = true;
      changed_.notify_all();
    });
  }
  ~FilmedFrames() override { Finish().status().IgnoreError(); }

  absl::StatusOr<std::optional<LiveFrame>> Newest(const std::stop_token& stop) override {
    MutexLock lock(mutex_);
    while (!newest_) {
      if (has_ended_ || stop.stop_requested()) return std::nullopt;
      changed_.wait_for(lock, kStopPeriod);
    }
    RawFrameSet set = *std::exchange(newest_, std::nullopt);
    LiveFrame frame;
    frame.name = FrameNameOf(set.number);
    frame.time_ns = set.device_time_ns > last_ns_ ? set.device_time_ns : last_ns_ + interval_ns_;
    frame.arrived_ns = arrived_ns_;
    frame.passed_over = std::exchange(passed_over_, 0);
    frame.source = std::make_shared<SetInMemory>(std::move(set), rig_);
    last_ns_ = frame.time_ns;
    return frame;
  }

  absl::StatusOr<v1::Take> Finish() override {
    stopping_ = true;
    if (recording_.joinable()) recording_.join();
    const MutexLock lock(mutex_);
    newest_.reset();
    return outcome_;
  }

 private:
  // Pictures are shared, not copied.
  void Offer(const RawFrameSet& set) {
    const MutexLock lock(mutex_);
    passed_over_ += newest_ ? 1 : 0;
    newest_ = set;
    arrived_ns_ = HostTime_ns();
    changed_.notify_all();
  }

  const std::vector<std::unique_ptr<CameraSource>> cameras_;
  LiveRecordingOptions options_;
  const Rig rig_;
  const int64_t interval_ns_;
  std::atomic<bool> stopping_ = false;
  std::thread recording_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<RawFrameSet> newest_ ABSL_GUARDED_BY(mutex_);
  int64_t arrived_ns_ ABSL_GUARDED_BY(mutex_) = 0;
  int passed_over_ ABSL_GUARDED_BY(mutex_) = 0;
  bool has_ended_ ABSL_GUARDED_BY(mutex_) = false;
  absl::StatusOr<v1::Take> outcome_ ABSL_GUARDED_BY(mutex_) =
      absl::InternalError("the recording has not ended");
  int64_t last_ns_ ABSL_GUARDED_BY(mutex_) = INT64_MIN / 2;
};

}  // namespace

absl::StatusOr<std::unique_ptr<CameraFeed>> CameraFeed::Start(const std::string& session_file,
                                                              const std::string& take, const Rig& rig,
                                                              double fps) {
  WEFT_ASSIGN_OR_RETURN(const v1::Session session, ReadSession(session_file));
  WEFT_ASSIGN_OR_RETURN(LiveRecordingOptions options, RecordingOptionsOf(session));
  WEFT_ASSIGN_OR_RETURN(std::vector<std::unique_ptr<CameraSource>> cameras, OpenCameras(session));
  return std::make_unique<FilmedFrames>(std::move(cameras), std::move(options), take, rig,
                                        session.fps() > 0 ? session.fps() : fps);
}

}  // namespace weft
