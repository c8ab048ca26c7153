#include "services/work/animation/live_feed.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_progress.h"
#include "services/studio/recording/take_verdict.h"
#include "services/work/animation/growing_take.h"

namespace weft {
namespace {

constexpr std::chrono::milliseconds kLookPeriod{4};
// A recorder notes lost frame sets, too, so that silence may be its end.
constexpr int64_t kSilentNs = 1'000'000'000;

class FollowedTake : public LiveFeed {
 public:
  FollowedTake(std::string folder, Rig rig, std::string after, double fps)
      : folder_(std::move(folder)),
        rig_(std::move(rig)),
        follower_(folder_),
        interval_ns_(std::max<int64_t>(1, std::llround(1e9 / fps))) {
    uint64_t number = 0;
    if (absl::SimpleAtoi(after, &number)) next_number_ = number + 1;
  }

  absl::StatusOr<std::optional<LiveFrame>> Newest(const std::stop_token& stop) override {
    int64_t looked_ns = HostTime_ns();
    while (!stop.stop_requested()) {
      WEFT_ASSIGN_OR_RETURN(const TakeProgress* progress, follower_.Poll());
      const std::vector<RecordedSet>& sets = progress->sets;
      if (!sets.empty() && sets.back().number >= next_number_) return Give(sets);
      if (progress->closed || is_abandoned_) return std::nullopt;
      if (HostTime_ns() - looked_ns > kSilentNs) {
        looked_ns = HostTime_ns();
        is_abandoned_ = !IsBeingRecorded(folder_);  // once more: it may just have been closed
      }
      std::this_thread::sleep_for(kLookPeriod);
    }
    return std::nullopt;
  }

 private:
  absl::StatusOr<std::optional<LiveFrame>> Give(const std::vector<RecordedSet>& sets) {
    const RecordedSet& newest = sets.back();
    if (!take_) {
      WEFT_ASSIGN_OR_RETURN(take_, GrowingTake::Open(folder_, rig_));
    }
    WEFT_ASSIGN_OR_RETURN(std::shared_ptr<const FrameSource> source, take_->Read(newest.number));
    LiveFrame frame;
    frame.name = FrameNameOf(newest.number);
    frame.source = std::move(source);
    frame.time_ns = newest.device_time_ns > last_ns_ ? newest.device_time_ns : last_ns_ + interval_ns_;
    frame.arrived_ns = newest.host_time_ns;
    for (auto set = sets.rbegin() + 1; set != sets.rend() && set->number >= next_number_; ++set)
      ++frame.passed_over;
    next_number_ = newest.number + 1;
    last_ns_ = frame.time_ns;
    return frame;
  }

  const std::string folder_;
  const Rig rig_;
  TakeFollower follower_;
  std::optional<GrowingTake> take_;
  const int64_t interval_ns_;
  uint64_t next_number_ = 0;
  int64_t last_ns_ = INT64_MIN / 2;
  bool is_abandoned_ = false;
};

class PlayedFrames : public LiveFeed {
 public:
  PlayedFrames(DriveFrameList list, double speed) : list_(std::move(list)), speed_(speed) {}

  absl::StatusOr<std::optional<LiveFrame>> Newest(const std::stop_token& stop) override {
    if (next_ >= list_.size()) return std::nullopt;
    if (!begun_ns_) begun_ns_ = HostTime_ns();
    while (HostTime_ns() < DueNs(next_)) {
      if (stop.stop_requested()) return std::nullopt;
      const int64_t left_ns = std::min<int64_t>(DueNs(next_) - HostTime_ns(), 50'000'000);
      if (left_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left_ns));
    }
    if (stop.stop_requested()) return std::nullopt;
    size_t at = next_;
    while (at + 1 < list_.size() && DueNs(at + 1) <= HostTime_ns()) ++at;
    const LiveFrame frame = {.name = list_.NameOf(at),
                             .source = list_.dump,
                             .index = list_.indices[at],
                             .time_ns = list_.time_ns[at],
                             .arrived_ns = DueNs(at),
                             .passed_over = static_cast<int>(at - next_)};
    next_ = at + 1;
    return frame;
  }

 private:
  int64_t DueNs(size_t at) const {
    const auto since_ns = static_cast<double>(list_.time_ns[at] - list_.time_ns[0]);
    return *begun_ns_ + std::llround(since_ns / speed_);
  }

  const DriveFrameList list_;
  const double speed_;
  size_t next_ = 0;
  std::optional<int64_t> begun_ns_;
};

}  // namespace

std::unique_ptr<LiveFeed> FollowTake(std::string folder, Rig rig, std::string after, double fps) {
  return std::make_unique<FollowedTake>(std::move(folder), std::move(rig), std::move(after), fps);
}

std::unique_ptr<LiveFeed> PlayFrames(DriveFrameList list, double speed) {
  return std::make_unique<PlayedFrames>(std::move(list), speed);
}

}  // namespace weft
