// A recorded take played from its first frame set to its last.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "capture/take/replay.h"
#include "weft/v1/replay.pb.h"

namespace weft {

// What a consumer is given: the set, and how much later than recorded it comes. False ends the replay.
using ReplayedSet = std::function<bool(RawFrameSet set, std::chrono::nanoseconds late)>;

// Passes every frame set of the replay to `consume` when it is due, in order. Sets are read ahead, so that
// reading delays them only where the disk is slower than the cameras were. Stepwise replays wait for Step.
// Frames that cannot be read are missing, with the reason.
v1::TakeReplay ReplayTake(Replay& replay, const ReplayedSet& consume);

}  // namespace weft
