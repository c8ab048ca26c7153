// A part of a recorded take, with the streams of some cameras moved in time against the others.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/take/recorded_take.h"

namespace weft {

struct TakeViewOptions {
  uint64_t first_set = 0;  // numbers, both included
  uint64_t last_set = UINT64_MAX;
  // Added to all times of a camera's frames. A shift of a period or more takes them to the sets that were
  // triggered then: by as many sets as periods fit in, rounded.
  std::map<std::string, int64_t> shift_ns;
};

// Thread safety: const functions may be called from any number of threads.
class TakeView {
 public:
  // Errors of RecordedTake; InvalidArgument: no frame set in the range, or a shifted camera that the take
  // lacks.
  static absl::StatusOr<TakeView> Open(const std::string& folder, const TakeViewOptions& options);

  const RecordedTake& take() const { return *take_; }
  // Numbers of the frame sets, in order.
  const std::vector<uint64_t>& sets() const { return sets_; }

  // One camera's frame of the set at `index`. Errors of RecordedTake::ReadRaw.
  absl::StatusOr<RawFrame> ReadRaw(size_t index, size_t camera) const;
  // All cameras; frames that cannot be read are listed as missing.
  absl::StatusOr<RawFrameSet> ReadSet(size_t index) const;
  // When the frame arrived; its device time where the take has no arrivals (made of images). Nothing where
  // the camera has no frame in the set.
  std::optional<int64_t> Time_ns(size_t index, size_t camera) const;

 private:
  TakeView() = default;
  const IndexRecord* Record(size_t index, size_t camera) const;

  std::shared_ptr<const RecordedTake> take_;
  std::vector<uint64_t> sets_;
  std::vector<int64_t> shift_ns_;    // of each camera
  std::vector<int64_t> shift_sets_;  // of each camera, in sets
};

// The time between triggers: the middle one of a stream's intervals. 0 where no stream tells.
int64_t PeriodOf_ns(const RecordedTake& take);

}  // namespace weft
