#include "services/work/animation/driving_trials.h"

#include <memory>
#include <utility>
#include <vector>

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
  absl::StatusOr<TimedDriver> driver = TimedDriver::Create(garment_, avatar_, driving_);
  if (!driver.ok()) return driver.status();
  bool follows = false;
  for (size_t frame = frames.first; frame < frames.end; ++frame) {
    if (stop_.stop_requested()) return absl::CancelledError("the evaluation was stopped");
    const auto k = static_cast<int>(frame - frames.first);
    const absl::StatusOr<ClothFrame> truth = take.Read(static_cast<int>(frame));
    if (!truth.ok()) return truth.status();
    absl::StatusOr<std::vector<ViewObservations>> views = seen.Look(static_cast<int>(frame), *truth);
    if (!views.ok()) return views.status();
    if (trial.beside)
      if (absl::Status status = trial.beside(k, *truth, *views); !status.ok()) return status;
    if (trial.dark(k)) views->front().observations.clear();
    if (trial.forgets) driver->Reset();
    ScoreTally unused;
    ScoreTally* const tally = trial.tally_of(k);
    ScoreTally& sum = tally != nullptr ? *tally : unused;
    sum.AddViews(*views);
    const absl::StatusOr<DrivenFrame> driven = driver->Drive(truth->time_ns, *views, seen.rig(), sum.ms);
    if (!driven.ok()) return driven.status();
    sum.lost_frames += driven->lost ? 1 : 0;
    if (!driven->lost) {
      const absl::Status status =
          sum.score.Add({driven->mesh.vertices_mm, driven->mesh.sigma_mm}, truth->vertices_mm,
                        DirectionsOf(*views, seen.rig(), garment_, nodes_), follows && tally != nullptr);
      if (!status.ok()) return status;
    }
    follows = !driven->lost;
  }
  return absl::OkStatus();
}

absl::Status DrivingTrials::TryElsewhere(ClothTake& take, const std::string& split, const FrameRange& frames,
                                         ScoreTable& table) {
  const absl::StatusOr<ClothFrame> first = take.Read(0);
  if (!first.ok()) return first.status();
  DrivingTrial trial;
  trial.tally_of = [&](int) { return &table.At(split, 2, kElsewhere); };
  for (const DrivingPlaces& places : kOtherPlaces) {
    absl::StatusOr<Rig> rig = DrivingRig(2, first->vertices_mm, observing_.seed, places);
    if (!rig.ok()) return rig.status();
    const auto seen = ObserveFrom(take, *std::move(rig), observing_);
    if (!seen.ok()) return seen.status();
    PaperBaseline paper(garment_, baseline_);
    if (absl::Status status = paper.Begin(kPixelCameras); !status.ok()) return status;
    trial.beside = [&](int frame, const ClothFrame& truth, const std::vector<ViewObservations>& views) {
      const Rig& of_views = (*seen)->rig();
      const VertexRays directions = DirectionsOf(views, of_views, garment_, nodes_);
      return paper.Add({truth, views, of_views, directions, frame > 0}, split, " elsewhere", driving_, table);
    };
    if (absl::Status status = Drive(take, **seen, frames, trial); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status DrivingTrials::TryAll(ClothTake& take, const std::string& split, const FrameRange& frames,
                                   ScoreTable& table) {
  if (absl::Status status = TryElsewhere(take, split, frames, table); !status.ok()) return status;
  const auto seen = ObserveTake(take, 2, observing_);
  if (!seen.ok()) return seen.status();
  DrivingTrial single;
  single.forgets = true;
  single.tally_of = [&](int) { return &table.At(split, 2, kFrameByFrame); };
  if (absl::Status status = Drive(take, **seen, frames, single); !status.ok()) return status;
  constexpr int kDarkEnd = kDarkFrom + kDarkFrames, kBack = kDarkEnd + kAfter;
  if (frames.end - frames.first < static_cast<size_t>(kBack + kAfter)) return absl::OkStatus();
  const auto is_after = [](int k) { return k >= kBack && k < kBack + kAfter; };
  DrivingTrial dark, never;
  dark.dark = [](int k) { return k >= kDarkFrom && k < kDarkEnd; };
  dark.tally_of = [&](int k) -> ScoreTally* {
    if (dark.dark(k)) return &table.At(split, 2, kOneDark);
    return is_after(k) ? &table.At(split, 2, kAfterDark) : nullptr;
  };
  if (absl::Status status = Drive(take, **seen, frames, dark); !status.ok()) return status;
  never.tally_of = [&](int k) -> ScoreTally* {
    return is_after(k) ? &table.At(split, 2, kNeverDark) : nullptr;
  };
  return Drive(take, **seen, frames, never);
}

}  // namespace weft
