// Which frames an evaluation looks at, and when they were taken.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/take/frame_source.h"
#include "services/formats/files/take_times.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct ListedFrame {
  std::string name;
  int64_t position = 0;  // in the take: frames are consecutive when their positions are
  int dump_index = -1;   // in the dump; -1 when it is not there
};

// The frames that `job` was asked for, in the order of the take: those of `truth`, or of `dump` without one.
// `truth` and `dump` may be empty; without either, what `result` holds of them.
// `job` without a specification was asked for every frame of the truth. NotFound: there is no frame.
absl::StatusOr<std::vector<ListedFrame>> ListFrames(const std::string& result, const std::string& truth,
                                                    const v1::Job& job, const FrameSource* dump,
                                                    const TakeTimes& times);

}  // namespace weft
