// Which frames a frame's refinement depends on.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "capture/take/frame_number.h"
#include "weft/v1/report.pb.h"

namespace weft {

// A failed frame gets a mesh between the nearest registered frames, at most so many steps away.
inline constexpr int kMaxBridge = 3;

// What a frame's neighbours must know of it.
struct FrameFacts {
  std::string frame;
  std::string images_fingerprint;
  bool registered = false;
  bool frames_alone = false;
  bool failed = false;
};
FrameFacts FactsOf(const v1::FrameReport& report);

// By position in the job; none while the frame is not complete.
using FactsAt = std::function<std::optional<FrameFacts>(int at)>;

// Positions of the nearest registered frames before and after, -1 where there are none in reach: of a failed
// frame kMaxBridge steps, of others one.
struct Neighbors {
  bool complete = true;  // false while a frame in between is not dealt with
  int previous = -1, next = -1;
  std::string window;  // TemporalReport.window of a frame that follows from them
};
// `steps`: of the job's frames. Frames beyond a gap in their numbers are no neighbours: what the cloth did in
// between is not known.
Neighbors FindNeighbors(int at, int frames, const FrameSteps& steps, const FrameFacts& own,
                        const FactsAt& facts_at);

// EffectiveOptions, or the options as they are where they are no longer valid.
v1::RegistrationOptions Canonical(const v1::RegistrationOptions& options);

// Whether all their keys agree: a frame of an earlier run, with other options or algorithms, is not there
// yet.
bool FromSameRun(const v1::FrameReport& a, const v1::FrameReport& b);

}  // namespace weft
