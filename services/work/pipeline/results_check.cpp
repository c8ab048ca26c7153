#include "services/work/pipeline/results_check.h"

#include <optional>
#include <set>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/frame_inputs.h"
#include "services/work/pipeline/frame_neighbors.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

// What one folder holds; kept small, since a job may have many frames.
struct Found {
  std::optional<FrameFacts> facts;  // none: incomplete
  std::string window;
  bool bridged = false;
  std::string problem;
  bool inputs_changed = false;
};

// An error only where the folder cannot be flushed.
absl::StatusOr<Found> LookAt(const ConfinedFolder& base, const v1::FrameReport& like,
                             const FingerprintsNow& inputs, const std::string& frame) {
  Found found;
  absl::StatusOr<ConfinedFolder> opened = base.Child(frame, ConfinedFolder::IfMissing::kFail);
  if (!opened.ok()) {
    found.problem = std::string(opened.status().message());
    return found;
  }
  const FrameFolder folder(*std::move(opened));
  const absl::StatusOr<v1::FrameReport> report = folder.Report();
  if (!report.ok()) {
    found.problem = "report.json is missing, damaged or of an older format";
  } else if (report->frame() != frame || !FromSameRun(*report, like)) {
    found.problem = "was computed from something else";
  } else if (report->images_fingerprint() != inputs.Of(frame)) {
    found.problem = "its images, scan or start changed since they were read";
    found.inputs_changed = true;
  } else {
    found.problem = folder.CheckAll(*report);
  }
  if (!found.problem.empty()) return found;
  WEFT_RETURN_IF_ERROR(folder.Sync());
  found.facts = FactsOf(*report);
  found.window = report->temporal().window();
  found.bridged = report->temporal().bridged();
  return found;
}

// The position of the frame to be done again so that frame `at` is refined; none where it is, or waits for
// frames that are done again anyway.
std::optional<int> WhoRefines(const std::vector<Found>& found, const FrameSteps& steps, int at) {
  const Found& own = found[at];
  if (own.facts->frames_alone) return std::nullopt;
  const Neighbors neighbors = FindNeighbors(at, static_cast<int>(found.size()), steps, *own.facts,
                                            [&found](int other) { return found[other].facts; });
  if (!neighbors.complete || neighbors.window == own.window) return std::nullopt;
  if (own.facts->registered) return at;
  // A failed frame may have failed by killing its workers, so that its neighbours' turn is safer.
  if (neighbors.previous >= 0) return neighbors.previous;
  if (neighbors.next >= 0) return neighbors.next;
  return own.bridged ? std::optional<int>(at) : std::nullopt;
}

}  // namespace

absl::StatusOr<std::vector<IncompleteFrame>> FindIncompleteFrames(const v1::Job& job,
                                                                  const std::vector<v1::FrameInfo>& frames) {
  v1::FrameReport like;
  *like.mutable_keys() = KeysOf(job.inputs(), job.spec().options());
  const absl::StatusOr<ConfinedFolder> base = ConfinedFolder::Open(job.spec().out());
  if (!base.ok() && !absl::IsNotFound(base.status())) return base.status();

  WEFT_ASSIGN_OR_RETURN(const FingerprintsNow inputs, FingerprintsNow::Open(job.spec()));

  std::vector<Found> found(frames.size());
  std::vector<IncompleteFrame> incomplete;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (!HasResult(frames[i].state())) continue;
    if (base.ok()) {
      WEFT_ASSIGN_OR_RETURN(found[i], LookAt(*base, like, inputs, frames[i].frame()));
    } else {
      found[i].problem = "its folder is gone";
    }
    const bool fits =
        found[i].facts && found[i].facts->failed == (frames[i].state() == v1::FRAME_STATE_FAILED);
    if (found[i].problem.empty() && !fits) found[i].problem = "is in another state than its report says";
    if (!found[i].problem.empty()) found[i].facts.reset();
    if (!found[i].problem.empty()) incomplete.push_back({i, found[i].problem, found[i].inputs_changed});
  }
  std::vector<std::string> names;
  for (const v1::FrameInfo& frame : frames) names.push_back(frame.frame());
  const FrameSteps steps(names);
  std::set<int> refine;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (!found[i].facts) continue;
    if (const auto who = WhoRefines(found, steps, static_cast<int>(i))) refine.insert(*who);
  }
  for (const int at : refine) {
    incomplete.push_back({static_cast<size_t>(at), "its neighbours' refinement is missing"});
  }
  if (base.ok()) {
    WEFT_RETURN_IF_ERROR(base->Sync());
  }
  return incomplete;
}

absl::Status TooManyRepairs(const std::string& out, const std::string& frame, const std::string& why) {
  return absl::AbortedError(absl::StrCat(out, ": frame ", frame, ": ", why, ", although it was registered ",
                                         "several times; keep other programs from changing its files, and "
                                         "register again"));
}

}  // namespace weft
