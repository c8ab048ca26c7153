#include "services/studio/recording/loss_verdict.h"

#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/take_words.h"

namespace weft {
namespace {

struct Remedy {
  const char* cause;  // words of the ledger
  const char* what;
};
constexpr Remedy kRemedies[] = {
    {"disconnected",
     "Look after power and cable of the camera and retake now; what was recorded stays readable."},
    {"does not answer",
     "Look after power and cable of the camera and retake now; what was recorded stays readable."},
    {"disk too slow", "Record to a faster disk, with fewer frames a second or with `compress`, and retake."},
    {"File too large",
     "Raise the limit on the size of files (`ulimit -f`), or record to a disk that takes larger ones, and "
     "retake; all sets before that are whole."},
    {"recording stopped",
     "Make room on the disk, or record to another, and retake; all sets before that are whole."},
    {"packets", "Use jumbo frames, or a link of its own for the camera (`weft doctor`), and retake."},
    {"late (tolerance", "Trigger all cameras, use PTP, or give a larger `tolerance_ms`, and retake."},
    {"those of the other cameras",
     "Find what sets that camera's clock, or give it the others' trigger, and retake; the others' frames are "
     "whole."},
    {"contradict their arrival",
     "Find what sets that camera's clock (its PTP master, or a program), and retake; the others' frames are "
     "whole."},
    {"nothing of it arrived",
     "Use jumbo frames, or a link of its own for the camera (`weft doctor`), and retake."},
    {"no frame within", "Look after the camera's cable, trigger and load of its link, and retake."},
    {"no camera delivered a frame",
     "Is there a trigger? `weft doctor --session FILE` checks the cameras; retake."},
    {"no frame at this trigger",
     "Look whether every camera gets the trigger and keeps its rate, and retake."},
    {"the video begins later",
     "Use the sets in which all cameras film (`weft take trim`). If the clips are of one moment, tell their "
     "offsets (`weft take import --offset NAME=S`) and import again."},
    {"the video has ended",
     "Use the sets in which all cameras film (`weft take trim`). If the clips are of one moment, tell their "
     "offsets (`weft take import --offset NAME=S`) and import again."},
    {"the video is damaged", "Copy the video again from the camera, where it is whole, and import again."},
    {"the video has no frame",
     "Film at a fixed rate: the camera left frames out. The sets that lack them are used without it."},
};

const v1::TakeCause* GreatestLoss(const v1::TakeInfo& info) {
  const v1::TakeCause* greatest = nullptr;
  for (const v1::TakeCause& cause : info.causes())
    if (greatest == nullptr || cause.count() > greatest->count()) greatest = &cause;
  return greatest;
}

std::string RemedyFor(const v1::TakeInfo& info) {
  if (const v1::TakeCause* loss = GreatestLoss(info))
    for (const Remedy& remedy : kRemedies)
      if (absl::StrContains(loss->cause(), remedy.cause)) return remedy.what;
  const v1::TakeCause* loss = GreatestLoss(info);
  const std::string who =
      loss == nullptr || loss->camera().empty() ? "its cameras" : "camera " + loss->camera();
  return absl::StrCat("Look after ", who, " (`weft doctor --session FILE`), and record again.");
}

}  // namespace

void AssessLosses(v1::TakeInfo& info) {
  v1::Verdict& verdict = *info.mutable_verdict();
  const uint64_t all = info.sets() + info.sets_dropped();
  if (all == 0) {
    AddFinding(verdict, v1::GRADE_BAD, "the take holds no frame set",
               "`weft doctor --session FILE` checks the cameras; is there a trigger? Then record again.");
    return;
  }
  std::string reason = absl::StrCat(WithSeparators(info.sets_complete()), " of ", WithSeparators(all),
                                    " frame sets have all cameras");
  if (info.sets_complete() == all)
    reason = all == 1 ? "the one frame set has all cameras"
                      : absl::StrCat("all ", WithSeparators(all), " frame sets have all cameras");
  if (const std::vector<std::string> losses = CauseLines(info.causes()); !losses.empty())
    absl::StrAppend(&reason, "; ", losses[0]);
  const double percent = 100 * static_cast<double>(info.sets_complete()) / static_cast<double>(all);
  v1::Verdict graded;
  AddCheck(graded, kTakeCompleteSets, percent);
  if (graded.grade() != v1::GRADE_GOOD) AddFinding(verdict, graded.grade(), reason, RemedyFor(info));
  AddCheck(verdict, kTakeCompleteSets, percent, reason);
}

}  // namespace weft
