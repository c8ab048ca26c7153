// Recorded takes played again: frame sets in their rhythm, or the streams as if they were live cameras.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "capture/camera/camera_source.h"
#include "capture/take/take_view.h"

namespace weft {

enum class ReplayMode {
  kPaced,     // by the recorded times, `speed` times as fast
  kFastest,   // whenever it is asked for the next frame
  kStepwise,  // one frame set per Step
};

struct ReplayOptions {
  ReplayMode mode = ReplayMode::kPaced;
  double speed = 1;
  TakeViewOptions view;

  absl::Status Validate() const;
};

// When which frame is due, on the host's steady clock. The clock starts when the first frame is asked for.
// Thread safety: all members may be called from any thread.
class ReplayClock {
 public:
  // `begin_ns`: the recorded time at which the clock starts.
  ReplayClock(const ReplayOptions& options, int64_t begin_ns)
      : mode_(options.mode), speed_(options.speed), begin_ns_(begin_ns) {}

  // Waits until a frame of this recorded time in the set at `index` is due, at most for `timeout`: false
  // where it is not yet.
  bool WaitFor(int64_t time_ns, size_t index, std::chrono::nanoseconds timeout);
  // Lets one more frame set pass where the mode is stepwise.
  void Step();
  // How much later than due it is now for this recorded time; 0 where nothing has a time.
  std::chrono::nanoseconds Lateness(int64_t time_ns) const;

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point DueAt(int64_t time_ns) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const ReplayMode mode_;
  const double speed_;
  const int64_t begin_ns_;
  mutable Mutex mutex_;
  std::condition_variable_any stepped_;
  std::optional<Clock::time_point> start_ ABSL_GUARDED_BY(mutex_);
  uint64_t steps_ ABSL_GUARDED_BY(mutex_) = 0;
};

// A take as what it was recorded from. Frames have the bytes, times, and counts that they were recorded with.
// Thread safety: const functions may be called from any number of threads.
class Replay {
 public:
  // Errors of TakeView; InvalidArgument: options.
  static absl::StatusOr<std::shared_ptr<Replay>> Open(const std::string& folder,
                                                      const ReplayOptions& options);

  const TakeView& view() const { return view_; }
  ReplayClock& clock() { return clock_; }
  // When the last frame of the set arrived; that of the set before where it has none.
  int64_t SetTime_ns(size_t index) const { return set_times_ns_[index]; }
  // The time between triggers; 0 where the take has no times.
  int64_t period_ns() const { return period_ns_; }

 private:
  Replay(TakeView view, std::vector<int64_t> set_times_ns, const ReplayOptions& options);

  const TakeView view_;
  const std::vector<int64_t> set_times_ns_;
  const int64_t period_ns_;
  ReplayClock clock_;
};

// A camera of the take as a live camera: kLostFrame where it has no frame, with the reason and about when
// that frame was taken; OutOfRange at the end. Trigger is Replay's step. Sources of one replay share its
// clock. NotFound: no such camera.
absl::StatusOr<std::unique_ptr<CameraSource>> OpenReplayCamera(std::shared_ptr<Replay> replay,
                                                               const std::string& id);

}  // namespace weft
