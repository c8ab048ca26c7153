#include "services/work/animation/driving_trials.h"

#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "services/work/animation/paper_baseline.h"
#include "services/work/animation/timed_driver.h"
#include "services/work/animation/truth_views.h"

namespace weft {
namespace {

constexpr char kElsewhere[] = "elsewhere", kOneDark[] = "one dark", kAfterDark[] = "after dark",
               kNeverDark[] = "never dark", kFrameByFrame[] = "frame by frame";
// Two cameras in other places: the arc between them, and how far they are.
constexpr DrivingPlaces kOtherPlaces[] = {{140, 3000}, {220, 1600}};
// When the first camera is dark, and how long after it the error is as it was.
constexpr int kDarkFrom = 10, kDarkFrames = 15, kAfter = 10;

}  // namespace

absl::Status DrivingTrials::Drive(ClothTake& take, ObservedTake& seen, const FrameRange& frames,
                                  const DrivingTrial& trial) {
  WEFT_ASSIGN_OR_RETURN(TimedDriver driver, TimedDriver::Create(garment_, avatar_, driving_));
  bool follows = false;
  for (size_t frame = frames.first; frame < frames.end; ++frame) {
    if (stop_.stop_requested()) return absl::CancelledError("the evaluation was stopped");
    const auto k = static_cast<int>(frame - frames.first);
    WEFT_ASSIGN_OR_RETURN(const ClothFrame truth, take.Read(static_cast<int>(frame)));
    WEFT_ASSIGN_OR_RETURN(std::vector<ViewObservations> views, seen.Observe(static_cast<int>(frame), truth));
    if (trial.beside) WEFT_RETURN_IF_ERROR(trial.beside(k, truth, views));
    if (trial.dark(k)) views.front().observations.clear();
    if (trial.forgets) driver.Reset();
    ScoreTally unused;
    ScoreTally* const tally = trial.tally_of(k);
    ScoreTally& sum = tally != nullptr ? *tally : unused;
    sum.AddViews(views);
    WEFT_ASSIGN_OR_RETURN(const DrivenFrame driven, driver.Drive(truth.time_ns, views, seen.rig(), sum.ms));
    sum.lost_frames += driven.lost ? 1 : 0;
    if (!driven.lost) {
      WEFT_RETURN_IF_ERROR(sum.score.Add({driven.mesh.vertices_mm, driven.mesh.sigma_mm}, truth.vertices_mm,
                                         DirectionsOf(views, seen.rig(), garment_, nodes_),
                                         follows && tally != nullptr));
    }
    follows = !driven.lost;
  }
  return absl::OkStatus();
}

absl::Status DrivingTrials::TryElsewhere(ClothTake& take, const std::string& split, const FrameRange& frames,
                                         ScoreTable& table) {
  WEFT_ASSIGN_OR_RETURN(const ClothFrame first, take.Read(0));
  DrivingTrial trial;
  trial.tally_of = [&](int) { return &table.At(split, 2, kElsewhere); };
  for (const DrivingPlaces& places : kOtherPlaces) {
    WEFT_ASSIGN_OR_RETURN(Rig rig, DrivingRig(2, first.vertices_mm, observing_.seed, places));
    WEFT_ASSIGN_OR_RETURN(const auto seen, ObserveFrom(take, std::move(rig), observing_));
    PaperBaseline paper(garment_, baseline_);
    WEFT_RETURN_IF_ERROR(paper.Begin(kPixelCameras));
    trial.beside = [&](int frame, const ClothFrame& truth, const std::vector<ViewObservations>& views) {
      const Rig& of_views = seen->rig();
      const VertexRays directions = DirectionsOf(views, of_views, garment_, nodes_);
      return paper.Add({truth, views, of_views, directions, frame > 0}, split, " elsewhere", driving_, table);
    };
    WEFT_RETURN_IF_ERROR(Drive(take, *seen, frames, trial));
  }
  return absl::OkStatus();
}

absl::Status DrivingTrials::TryAll(ClothTake& take, const std::string& split, const FrameRange& frames,
                                   ScoreTable& table) {
  WEFT_RETURN_IF_ERROR(TryElsewhere(take, split, frames, table));
  WEFT_ASSIGN_OR_RETURN(const auto seen, ObserveTake(take, 2, observing_));
  DrivingTrial single;
  single.forgets = true;
  single.tally_of = [&](int) { return &table.At(split, 2, kFrameByFrame); };
  WEFT_RETURN_IF_ERROR(Drive(take, *seen, frames, single));
  constexpr int kDarkEnd = kDarkFrom + kDarkFrames, kBack = kDarkEnd + kAfter;
  if (frames.end - frames.first < static_cast<size_t>(kBack + kAfter)) return absl::OkStatus();
  const auto is_after = [](int k) { return k >= kBack && k < kBack + kAfter; };
  DrivingTrial dark, never;
  dark.dark = [](int k) { return k >= kDarkFrom && k < kDarkEnd; };
  dark.tally_of = [&](int k) -> ScoreTally* {
    if (dark.dark(k)) return &table.At(split, 2, kOneDark);
    return is_after(k) ? &table.At(split, 2, kAfterDark) : nullptr;
  };
  WEFT_RETURN_IF_ERROR(Drive(take, *seen, frames, dark));
  never.tally_of = [&](int k) -> ScoreTally* {
    return is_after(k) ? &table.At(split, 2, kNeverDark) : nullptr;
  };
  return Drive(take, *seen, frames, never);
}

}  // namespace weft
