#include "services/results/report/job_summary.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/median.h"
#include "services/results/report/camera_facts.h"
#include "services/results/report/driven_sigma.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

v1::FrameCounts CountFrames(const std::vector<v1::FrameReport>& frames) {
  v1::FrameCounts counts;
  for (const v1::FrameReport& frame : frames) {
    counts.set_total(counts.total() + 1);
    switch (frame.state()) {
      case v1::FRAME_STATE_DONE:
        counts.set_done(counts.done() + 1);
        break;
      case v1::FRAME_STATE_DEGRADED:
        counts.set_degraded(counts.degraded() + 1);
        break;
      case v1::FRAME_STATE_FAILED:
        counts.set_failed(counts.failed() + 1);
        counts.set_bridged(counts.bridged() + frame.temporal().bridged());
        break;
      case v1::FRAME_STATE_CANCELLED:
        counts.set_cancelled(counts.cancelled() + 1);
        break;
      case v1::FRAME_STATE_RUNNING:
        counts.set_running(counts.running() + 1);
        break;
      default:
        counts.set_waiting(counts.waiting() + 1);
    }
  }
  return counts;
}

using ReasonCounts = google::protobuf::RepeatedPtrField<v1::ReasonCount>;

void CountReason(const std::string& reason, int count, ReasonCounts& counts) {
  auto entry = std::ranges::find_if(counts, [&](const auto& other) { return other.reason() == reason; });
  v1::ReasonCount& counted = entry == counts.end() ? *counts.Add() : *entry;
  counted.set_reason(reason);
  counted.set_count(counted.count() + count);
}

void SortByCount(ReasonCounts& counts) {
  std::stable_sort(counts.pointer_begin(), counts.pointer_end(),
                   [](const auto* a, const auto* b) { return a->count() > b->count(); });
}

void AddView(const v1::ViewReport& view, v1::PageCamera& camera) {
  if (!view.missing_reason().empty()) {
    camera.set_frames_missing(camera.frames_missing() + 1);
    CountReason(view.missing_reason(), 1, *camera.mutable_missing_reasons());
    return;
  }
  camera.set_frames_seen(camera.frames_seen() + 1);
  camera.set_frames_moved(camera.frames_moved() + view.has_moved_ms());
  camera.set_longest_move_ms(std::max(camera.longest_move_ms(), std::abs(view.moved_ms())));
  camera.set_centers(camera.centers() + view.centers());
  camera.set_corners(camera.corners() + view.corners());
  camera.set_patches_accepted(camera.patches_accepted() + view.patches_accepted());
  for (const v1::ReasonCount& rejected : view.patches_rejected())
    CountReason(rejected.reason(), rejected.count(), *camera.mutable_patches_rejected());
  if (!view.has_bias()) return;
  const int n = camera.frames_with_bias() + 1;
  const auto mean = [n](double of_others, double value) { return of_others + (value - of_others) / n; };
  camera.set_frames_with_bias(n);
  camera.set_bias_x_px(mean(camera.bias_x_px(), view.bias().mean_x_px()));
  camera.set_bias_y_px(mean(camera.bias_y_px(), view.bias().mean_y_px()));
  camera.set_bias_significance(mean(camera.bias_significance(), view.bias().significance()));
}

std::vector<v1::PageCamera> SummarizeCameras(const std::vector<v1::FrameReport>& frames) {
  struct CameraSums {
    double squares = 0, observations = 0;  // of the residuals
    std::vector<double> grey_levels;
  };
  std::vector<v1::PageCamera> cameras;
  std::vector<CameraSums> sums;
  std::map<std::string, size_t> index_of;
  for (const v1::FrameReport& frame : frames) {
    for (const v1::ViewReport& view : frame.views()) {
      const auto [entry, added] = index_of.try_emplace(view.camera(), cameras.size());
      if (added) cameras.emplace_back().set_camera(view.camera());
      AddView(view, cameras[entry->second]);
      sums.resize(cameras.size());
      CameraSums& sum = sums[entry->second];
      if (view.grey_levels() > 0) sum.grey_levels.push_back(view.grey_levels());
      sum.squares += view.bias().observations() * view.bias().rms_px() * view.bias().rms_px();
      sum.observations += view.bias().observations();
    }
  }
  for (size_t c = 0; c < cameras.size(); ++c) {
    SortByCount(*cameras[c].mutable_missing_reasons());
    SortByCount(*cameras[c].mutable_patches_rejected());
    cameras[c].set_residual_px(sums[c].observations > 0 ? std::sqrt(sums[c].squares / sums[c].observations)
                                                        : kNoNumber);
    cameras[c].set_median_grey_levels(MedianOf(std::move(sums[c].grey_levels)));
  }
  return cameras;
}

std::vector<v1::PageGarment> SummarizeGarments(const std::vector<v1::FrameReport>& frames) {
  struct GarmentSums {
    double observed = 0, observable = 0;
    std::vector<double> sigmas_mm;  // medians of the frames
  };
  std::vector<v1::PageGarment> garments;
  std::vector<GarmentSums> sums;
  for (const v1::FrameReport& frame : frames) {
    if (!IsRegistered(frame.state())) continue;
    for (const v1::GarmentReport& of_frame : frame.mesh().garments()) {
      auto garment =
          std::ranges::find_if(garments, [&](const auto& other) { return other.id() == of_frame.id(); });
      if (garment == garments.end()) {
        garment = garments.insert(garments.end(), v1::PageGarment());
        garment->set_id(of_frame.id());
        garment->set_vertices(of_frame.vertices());
        garment->set_lowest_coverage(kNoNumber);
        sums.emplace_back();
      }
      GarmentSums& sum = sums[static_cast<size_t>(garment - garments.begin())];
      sum.observed += of_frame.observed();
      sum.observable += of_frame.vertices_with_cell();
      sum.sigmas_mm.push_back(of_frame.median_observed_sigma_mm());
      if (garment->lowest_coverage() <= of_frame.coverage()) continue;
      garment->set_lowest_coverage(of_frame.coverage());
      garment->set_lowest_coverage_frame(frame.frame());
    }
  }
  for (size_t g = 0; g < garments.size(); ++g) {
    garments[g].set_coverage(sums[g].observable > 0 ? sums[g].observed / sums[g].observable : 0);
    garments[g].set_median_sigma_mm(MedianOf(std::move(sums[g].sigmas_mm)));
  }
  return garments;
}

// Figures over the registered frames.
void SummarizeMeshes(const std::vector<v1::FrameReport>& frames, JobSummary& summary) {
  int64_t observed = 0, observable = 0;
  std::vector<double> cells, sigmas, times, rays, residuals_px;
  summary.lowest_coverage = summary.highest_coverage = kNoNumber;
  for (const v1::FrameReport& frame : frames) {
    summary.peak_memory_mib = std::max(summary.peak_memory_mib, frame.peak_memory_mib());
    if (!IsRegistered(frame.state())) continue;
    observed += frame.mesh().observed();
    observable += frame.mesh().vertices_with_cell();
    if (frame.has_cloud()) cells.push_back(frame.cloud().centers());
    sigmas.push_back(frame.has_driven() ? frame.driven().median_sigma_mm()
                                        : frame.mesh().median_observed_sigma_mm());
    times.push_back(frame.total_ms());
    if (frame.has_driven()) {
      summary.is_driven = true;
      rays.push_back(frame.driven().rays() - frame.driven().rejected_rays());
      residuals_px.push_back(frame.driven().residual_px());
      continue;
    }
    if (!(frame.mesh().coverage() <= summary.highest_coverage))
      summary.highest_coverage = frame.mesh().coverage();
    if (!(frame.mesh().coverage() >= summary.lowest_coverage)) {
      summary.lowest_coverage = frame.mesh().coverage();
      summary.lowest_coverage_frame = frame.frame();
    }
  }
  summary.median_rays = MedianOf(std::move(rays));
  summary.median_residual_px = MedianOf(std::move(residuals_px));
  summary.coverage = observable > 0 && !summary.is_driven
                         ? static_cast<double>(observed) / static_cast<double>(observable)
                         : kNoNumber;
  summary.median_cells = MedianOf(std::move(cells));
  summary.median_sigma_mm = MedianOf(std::move(sigmas));
  summary.median_frame_ms = MedianOf(std::move(times));
}

std::string WithReason(std::string sentence, const std::string& reason) {
  return reason.empty() ? sentence + "." : absl::StrCat(sentence, ": ", reason);
}

}  // namespace

bool IsRegistered(v1::FrameState state) {
  return state == v1::FRAME_STATE_DONE || state == v1::FRAME_STATE_DEGRADED;
}

double MedianOf(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return kNoNumber;
  const size_t half = values.size() / 2;
  std::ranges::sort(values);
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

JobSummary Summarize(const v1::Job& job, const std::vector<v1::FrameReport>& frames) {
  JobSummary summary;
  summary.counts = job.frames().total() > 0 ? job.frames() : CountFrames(frames);
  summary.registered = summary.counts.done() + summary.counts.degraded();
  const bool timed = job.started_unix_ns() > 0 && job.finished_unix_ns() >= job.started_unix_ns();
  summary.wall_ms =
      timed ? 1e-6 * static_cast<double>(job.finished_unix_ns() - job.started_unix_ns()) : kNoNumber;
  SummarizeMeshes(frames, summary);
  summary.cameras = SummarizeCameras(frames);
  summary.facts = FactsOf(frames);
  summary.garments = SummarizeGarments(frames);
  for (const v1::FrameReport& frame : frames)
    for (const v1::GarmentOverlap& overlap : frame.mesh().overlaps())
      ++summary.overlaps[{overlap.inner(), overlap.outer()}];
  std::map<std::string, int> reasons;
  for (const v1::FrameReport& frame : frames) {
    if (frame.state() == v1::FRAME_STATE_FAILED) ++reasons[frame.reason()];
  }
  summary.failure_reasons.assign(reasons.begin(), reasons.end());
  std::ranges::stable_sort(summary.failure_reasons,
                           [](const auto& a, const auto& b) { return a.second > b.second; });
  return summary;
}

std::vector<CameraAlarm> CameraAlarms(const JobSummary& summary) {
  // Decoding itself leaves some hundredths of a pixel, which many cells make significant.
  constexpr double kSignificant = 4, kNotablePx = 0.2;
  // One wrong camera pulls the others along, by the share that it has in the points.
  constexpr double kShareOfWorst = 0.5;
  std::vector<const v1::PageCamera*> off;
  const auto length_px = [](const v1::PageCamera* c) { return std::hypot(c->bias_x_px(), c->bias_y_px()); };
  // Of what most cameras have, and at least. A camera that is a frame late has ten times as much on a take of
  // twelve cameras of 300 x 400 px. Right takes: see the last line of `accuracy_cameras`.
  constexpr double kNotableMedians = 5, kNotableMedianPx = 0.3;
  std::set<std::string> apart, told;
  for (const CameraStanding& camera : summary.facts.cameras)
    if (IsApart(camera)) apart.insert(camera.camera);
  for (const v1::PageCamera& camera : summary.cameras) {
    if (apart.contains(camera.camera())) continue;
    if (camera.bias_significance() > kSignificant && length_px(&camera) > kNotablePx) off.push_back(&camera);
  }
  std::ranges::stable_sort(off, [&](auto* a, auto* b) { return length_px(a) > length_px(b); });
  std::vector<CameraAlarm> alarms;
  for (const v1::PageCamera* camera : off) {
    if (length_px(camera) < kShareOfWorst * length_px(off[0])) break;
    told.insert(camera->camera());
    const std::string text = absl::StrFormat(
        "Camera %s moved, or its calibration is off: it sees the cloth %.2f px (right %.2f, down %.2f; %.0f "
        "sigmas) from where the others see it; correct the rig with weft rig refine, or calibrate again.",
        camera->camera(), length_px(camera), camera->bias_x_px(), camera->bias_y_px(),
        camera->bias_significance());
    alarms.push_back({text, "Correct the rig with `weft rig refine`, or calibrate again."});
  }
  // One that moved around the cloth, or whose images are late, may see it beside its place everywhere and
  // right in the mean.
  std::vector<double> medians_px;
  for (const CameraStanding& camera : summary.facts.cameras)
    if (camera.compared >= kLeastCompared) medians_px.push_back(camera.median_px);
  if (medians_px.empty()) return alarms;
  const double usual_px = Median(std::move(medians_px));
  for (const CameraStanding& camera : summary.facts.cameras) {
    if (told.contains(camera.camera) || IsApart(camera) || camera.compared < kLeastCompared ||
        camera.median_px < std::max(kNotableMedianPx, kNotableMedians * usual_px))
      continue;
    const std::string text = absl::StrFormat(
        "Camera %s moved, its calibration is off, or its images are of another moment: it sees cells %.2g px "
        "from where the others see them, most cameras %.2g px.",
        camera.camera, camera.median_px, usual_px);
    // A rig that is refined hides that a camera is late.
    alarms.push_back(
        {text, absl::StrCat("See first whether its images are late: `weft take sync` tells of a take, and "
                            "`weft take trim TAKE --out OTHER --shift ",
                            camera.camera,
                            "=MS` moves its times. `weft rig refine` corrects cameras that moved, no "
                            "late ones.")});
  }
  return alarms;
}

const char* DoneWord(const v1::Job& job) {
  if (job.spec().has_work()) return "done";
  return job.has_driven() ? "driven" : "registered";
}

std::string Headline(const v1::Job& job, const JobSummary& summary) {
  const int total = summary.counts.total();
  const char* const done = DoneWord(job);
  std::string registered =
      absl::StrCat(FormatCount(summary.registered), " of ", Counted(total, "frame", "frames"), " ", done);
  if (total == 0) registered = "No frames";
  if (total > 0 && summary.registered == 0)
    registered = absl::StrCat(total == 1 ? "The frame was not " : "No frame was ", done);
  // An avatar is for cameras too few to observe cells.
  if (std::isfinite(summary.coverage) && !job.has_driven()) {
    absl::StrAppend(&registered, ", ", FormatPercent(summary.coverage), " of the cells observed");
  }
  switch (job.state()) {
    case v1::JOB_STATE_QUEUED:
      return absl::StrCat("Waiting to start: ", registered, " so far.");
    case v1::JOB_STATE_RUNNING:
      return absl::StrCat("Still running: ", registered, " so far.");
    case v1::JOB_STATE_CANCELLED:
      return absl::StrCat("Cancelled: ", registered, ".");
    case v1::JOB_STATE_FAILED:
      return absl::StrCat("The job failed: ", registered, ".");
    default:
      return absl::StrCat(registered, ".");
  }
}

std::vector<std::string> Remarks(const v1::Job& job, const JobSummary& summary) {
  std::vector<std::string> remarks;
  const auto frames = [](int count, absl::string_view one, absl::string_view many) {
    return absl::StrCat(Counted(count, "frame", "frames"), " ", count == 1 ? one : many);
  };
  if (!job.message().empty()) remarks.push_back(job.message());
  for (CameraAlarm& alarm : CameraAlarms(summary)) remarks.push_back(std::move(alarm.text));
  if (std::string note = DrivenSigmaNote(job); !note.empty()) remarks.push_back(std::move(note));
  if (!summary.garments.empty() && !summary.is_driven)
    remarks.push_back(absl::StrCat("Of the garments' cells were observed: ",
                                   absl::StrJoin(summary.garments, ", ",
                                                 [](std::string* out, const v1::PageGarment& garment) {
                                                   absl::StrAppend(out, garment.id(), " ",
                                                                   FormatPercent(garment.coverage()));
                                                 }),
                                   "."));
  int explained = 0;
  for (size_t i = 0; i < summary.failure_reasons.size() && i < 3; ++i) {
    const auto& [reason, count] = summary.failure_reasons[i];
    remarks.push_back(WithReason(frames(count, "failed", "failed"), reason));
    explained += count;
  }
  const int unexplained = summary.counts.failed() - explained;
  if (unexplained > 0)
    remarks.push_back(frames(unexplained, "failed for other reasons (see the table of frames).",
                             "failed for other reasons (see the table of frames)."));
  if (const int n = summary.counts.bridged(); n > 0) {
    remarks.push_back(absl::StrCat(FormatCount(n), " of them ", n == 1 ? "is" : "are",
                                   " bridged: the mesh comes from the frames around."));
  }
  if (const int n = summary.counts.degraded(); n > 0) {
    remarks.push_back(frames(n, "is degraded: it was registered, with cameras missing.",
                             "are degraded: they were registered, with cameras missing."));
  }
  if (const int n = summary.counts.cancelled(); n > 0) {
    remarks.push_back(frames(n, "was not computed.", "were not computed."));
  }
  if (const int n = summary.counts.reused(); n > 0) {
    remarks.push_back(frames(n, "was found complete from an earlier run and kept.",
                             "were found complete from an earlier run and kept."));
  }
  return remarks;
}

}  // namespace weft
