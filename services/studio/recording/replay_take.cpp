#include "services/studio/recording/replay_take.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "base/median.h"
#include "base/stopwatch.h"
#include "capture/file/checksum.h"

namespace weft {
namespace {

double Milliseconds(std::chrono::nanoseconds time) { return static_cast<double>(time.count()) / 1e6; }

// Of bytes, times and counts of the set's frames, and of the sets before.
uint64_t ChecksumOf(const RawFrameSet& set, uint64_t before) {
  std::vector<uint64_t> numbers = {before, set.number};
  for (const RawFrame& frame : set.frames) {
    for (const uint64_t value :
         {Checksum(frame.camera_id.data(), frame.camera_id.size()), static_cast<uint64_t>(frame.format),
          static_cast<uint64_t>(frame.width_px), static_cast<uint64_t>(frame.height_px),
          static_cast<uint64_t>(frame.device_time_ns), static_cast<uint64_t>(frame.host_time_ns),
          frame.device_frame_id, Checksum(frame.bytes->data(), frame.bytes->size())})
      numbers.push_back(value);
  }
  return Checksum(numbers.data(), numbers.size() * sizeof(uint64_t));
}

}  // namespace

v1::TakeReplay ReplayTake(Replay& replay, const ReplayedSet& consume) {
  v1::TakeReplay summary;
  std::vector<double> late_ms;
  uint64_t checksum = 0;
  const Stopwatch watch;
  for (size_t i = 0; i < replay.view().sets().size(); ++i) {
    RawFrameSet set = *replay.view().ReadSet(i);  // fails out of range alone
    const int64_t due_ns = replay.SetTime_ns(i);
    while (!replay.clock().WaitFor(due_ns, i, std::chrono::seconds(1))) {
    }
    const std::chrono::nanoseconds late = replay.clock().Lateness(due_ns);
    late_ms.push_back(Milliseconds(late));
    checksum = ChecksumOf(set, checksum);
    summary.set_sets(summary.sets() + 1);
    summary.set_frames(summary.frames() + set.frames.size());
    summary.set_missing(summary.missing() + set.missing.size());
    summary.set_bytes(summary.bytes() + set.bytes());
    if (!consume(std::move(set), late)) break;
  }
  summary.set_wall_s(watch.Seconds());
  summary.set_checksum(absl::StrFormat("%016x", checksum));
  if (late_ms.empty()) return summary;
  summary.set_late_median_ms(Median(late_ms));
  summary.set_late_worst_ms(*std::ranges::max_element(late_ms));
  return summary;
}

}  // namespace weft
