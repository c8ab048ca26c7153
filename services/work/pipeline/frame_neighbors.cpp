#include "services/work/pipeline/frame_neighbors.h"

#include "absl/strings/str_cat.h"
#include "services/formats/options/presets.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {

FrameFacts FactsOf(const v1::FrameReport& report) {
  FrameFacts facts{report.frame(), report.images_fingerprint()};
  facts.registered = report.state() == v1::FRAME_STATE_DONE || report.state() == v1::FRAME_STATE_DEGRADED;
  facts.failed = report.state() == v1::FRAME_STATE_FAILED;
  facts.frames_alone = report.options().frames_alone();
  return facts;
}

Neighbors FindNeighbors(int at, int frames, const FrameSteps& steps, const FrameFacts& own,
                        const FactsAt& facts_at) {
  const int64_t reach = own.failed ? kMaxBridge : 1;
  Neighbors found;
  found.window = own.images_fingerprint;
  for (const int direction : {-1, 1}) {
    int& neighbor = direction < 0 ? found.previous : found.next;
    for (int i = 1; i <= reach && neighbor < 0; ++i) {
      const int other = at + direction * i;
      if (other < 0 || other >= frames) break;
      const int64_t way = direction * steps.Between(static_cast<size_t>(at), static_cast<size_t>(other));
      // Less than half a step is no neighbour either: the refinement takes both for equally far.
      if (way > reach || (way < 1 && !own.failed)) break;
      const std::optional<FrameFacts> facts = facts_at(other);
      if (!facts) {
        found.complete = false;
        return found;
      }
      if (facts->registered) neighbor = other;
      absl::StrAppend(&found.window, " ", facts->frame, ":", facts->images_fingerprint);
    }
  }
  return found;
}

v1::RegistrationOptions Canonical(const v1::RegistrationOptions& options) {
  const absl::StatusOr<v1::RegistrationOptions> effective = EffectiveOptions(options);
  return effective.ok() ? *effective : options;
}

bool FromSameRun(const v1::FrameReport& a, const v1::FrameReport& b) {
  return !a.keys().empty() && !FirstDifference(a.keys(), b.keys());
}

}  // namespace weft
