#include "services/results/report/job_verdict.h"

#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"
#include "services/formats/verdict/grey_levels.h"
#include "services/formats/verdict/verdict.h"
#include "services/results/report/html_text.h"
#include "services/results/report/job_frames.h"
#include "services/results/report/job_summary.h"

namespace weft {
namespace {

// Sums over all frames.
struct Totals {
  int64_t images = 0, missing_images = 0;
  int64_t cells = 0;  // decoded, over all images
  int64_t points = 0, rays_apart = 0;
  int64_t registered_cells = 0, strangers = 0;  // of frames with a mesh: cells, and those off the template
  std::string missing_reason;                   // the first
  int64_t scan_points = 0, scan_found = 0;      // of frames with a scan
  std::vector<double> scan_distances_mm;        // medians of those where points found the cloth
  int64_t meshes = 0, elsewhere = 0;            // frames with a mesh, and those whose map fits elsewhere
  v1::MapPlaceReport place;                     // of those, the last, with the cells of all
};

void AddPlace(v1::MapPlaceReport place, Totals& sum) {
  ++sum.elsewhere;
  place.set_cells(place.cells() + sum.place.cells());
  place.set_outside(place.outside() + sum.place.outside());
  place.set_outside_there(place.outside_there() + sum.place.outside_there());
  sum.place = std::move(place);
}

Totals Sum(const std::vector<v1::FrameReport>& frames) {
  Totals sum;
  for (const v1::FrameReport& frame : frames) {
    for (const v1::ViewReport& view : frame.views()) {
      ++sum.images;
      sum.cells += view.centers();
      sum.missing_images += !view.missing_reason().empty();
      if (sum.missing_reason.empty()) sum.missing_reason = view.missing_reason();
    }
    if (frame.has_mesh()) {
      sum.registered_cells += frame.cloud().centers();
      sum.strangers += frame.mesh().unclaimed_points();
      ++sum.meshes;
      if (frame.mesh().has_map_fits()) AddPlace(frame.mesh().map_fits(), sum);
      const v1::ScanReport& scan = frame.mesh().scan();
      sum.scan_points += scan.points();
      sum.scan_found += scan.found();
      if (scan.found() > 0) sum.scan_distances_mm.push_back(scan.median_distance_mm());
    }
    sum.points += frame.cloud().centers() + frame.cloud().corners();
    for (const v1::ReasonCount& rejected : frame.cloud().rejected())
      if (rejected.reason() == "no_consensus") sum.rays_apart += rejected.count();
  }
  return sum;
}

double Percent(int64_t part, int64_t whole) {
  return 100 * static_cast<double>(part) / static_cast<double>(whole);
}

// Are board and rig those of the take?
void AssessInputs(const Totals& sum, const CameraFacts& facts, v1::Verdict& verdict) {
  constexpr int64_t kTellingNodes = 100;
  const int64_t used = sum.images - sum.missing_images;
  if (used > 0) {
    const double cells = static_cast<double>(sum.cells) / static_cast<double>(used);
    AddCheck(
        verdict, kDecodeCells, cells,
        cells < kDecodeCells.usable
            ? absl::StrCat("hardly any cell of the board was decoded, ", sum.cells, " in ",
                           Counted(static_cast<int>(used), "image", "images"), ": is it the right board?")
            : "");
  }
  // Who is exchanged says more than that the rays hardly meet; of cameras that are just apart the others may
  // be wrong.
  const bool is_named = FaultOf(facts.cameras).is_named;
  if (is_named) AddAgreementCheck(facts.cameras, verdict);
  AddScaleCheck(facts, verdict);
  if (const int64_t nodes = sum.points + sum.rays_apart; nodes >= kTellingNodes) {
    const double meet = Percent(sum.points, nodes);
    AddCheck(verdict, kRegisterRaysMeet, meet,
             meet < kRegisterRaysMeet.usable
                 ? absl::StrCat("the cameras' rays hardly meet, at ", sum.points, " of ", nodes,
                                " cells and corners: is it the rig of this take?")
                 : "");
  }
  if (!is_named) AddAgreementCheck(facts.cameras, verdict);
  AddOffsetCheck(facts.cameras, verdict);
  AddSightCheck(facts.cameras, verdict);
  AddBlankCheck(facts.cameras, verdict);
  AddRepeatCheck(facts.cameras, verdict);
  AddKnownCheck(facts, verdict);
}

void AssessExposure(const JobSummary& summary, v1::Verdict& verdict) {
  std::vector<PrintContrast> cameras;
  for (const v1::PageCamera& camera : summary.cameras)
    if (std::isfinite(camera.median_grey_levels()))
      cameras.push_back({absl::StrCat("camera ", camera.camera()), camera.median_grey_levels()});
  AddGreyLevelsCheck(verdict, cameras);
}

// All vertices are beside the cell that they are.
void AssessPlace(const Totals& sum, v1::Verdict& verdict) {
  if (2 * sum.elsewhere <= sum.meshes) return;
  const v1::MapPlaceReport& place = sum.place;
  const std::string how = place.half_turn() ? "it is turned by half a turn on the board"
                                            : absl::StrCat("its rows move by ", place.rows(),
                                                           " and its columns by ", place.cols());
  // A template may lack the cells at one border of its panels, and cameras may not see the other border.
  const bool is_sure = place.half_turn() || (place.rows() != 0 && place.cols() != 0);
  AddFinding(
      verdict, is_sure ? v1::GRADE_BAD : v1::GRADE_USABLE,
      absl::StrCat("the template's map is of another place of the board",
                   is_sure ? "" : ", or lacks cells at one border", ": ", place.outside(), " of ",
                   place.cells(), " triangulated cells have no vertex, ", place.outside_there(),
                   " have none once ", how),
      "Rows and columns of a map count from 0, from the board's corner at the top left: correct it, and "
      "import the template again.");
}

void AssessTemplate(const Totals& sum, v1::Verdict& verdict) {
  if (sum.registered_cells == 0) return;
  AssessPlace(sum, verdict);
  const double on_template = Percent(sum.registered_cells - sum.strangers, sum.registered_cells);
  AddCheck(verdict, kRegisterOnTemplate, on_template,
           on_template < kRegisterOnTemplate.good
               ? absl::StrCat(
                     sum.strangers, " of ", sum.registered_cells,
                     " triangulated cells are on the board but not on the template: is it the template of "
                     "another part of the board?")
               : "");
}

void AssessScans(const Totals& sum, v1::Verdict& verdict) {
  if (sum.scan_points == 0) return;
  AddCheck(verdict, kRegisterScanPoints, Percent(sum.scan_found, sum.scan_points),
           sum.scan_found == 0 ? "no point of the scans lies on the cloth, so hidden cloth is as without them"
                               : "");
  if (!sum.scan_distances_mm.empty()) AddCheck(verdict, kRegisterScanDistance, Median(sum.scan_distances_mm));
}

void AssessFrames(const v1::Job& job, const JobSummary& summary, v1::Verdict& verdict) {
  const int total = summary.counts.total();
  if (job.state() == v1::JOB_STATE_CANCELLED) {
    AddFinding(verdict, v1::GRADE_BAD,
               absl::StrCat("cancelled with ", summary.registered, " of ", Counted(total, "frame", "frames"),
                            " ", DoneWord(job)),
               "Run the same command again: it resumes the job.");
    return;
  }
  if (job.state() == v1::JOB_STATE_FAILED && !job.message().empty() && summary.failure_reasons.empty())
    AddFinding(verdict, v1::GRADE_BAD, job.message(),
               "Fix what the message names, and run the same command again.");
  if (total == 0) return;
  const int failed = total - summary.registered;
  std::string reason;
  if (failed > 0) {
    reason = absl::StrCat(failed, " of ", Counted(total, "frame", "frames"), " could not be ", DoneWord(job));
    if (!summary.failure_reasons.empty()) absl::StrAppend(&reason, ": ", summary.failure_reasons[0].first);
  }
  AddCheck(verdict, kRegisterFrames, Percent(summary.registered, total), reason);
}

}  // namespace

v1::Verdict AssessJob(const v1::Job& job, const std::vector<v1::FrameReport>& frames) {
  const JobSummary summary = Summarize(job, frames);
  const Totals sum = Sum(frames);
  v1::Verdict verdict;
  const std::string registered = absl::StrCat(
      summary.registered, " of ", Counted(summary.counts.total(), "frame", "frames"), " ", DoneWord(job));
  AddFinding(verdict, v1::GRADE_GOOD,
             std::isfinite(summary.coverage) && !job.has_driven()
                 ? absl::StrFormat("%s, %.1f %% of the cells observed", registered, 100 * summary.coverage)
                 : registered,
             "");
  AssessInputs(sum, summary.facts, verdict);
  AssessExposure(summary, verdict);
  AssessTemplate(sum, verdict);
  AssessScans(sum, verdict);
  AssessFrames(job, summary, verdict);
  if (sum.images > 0) {
    AddCheck(verdict, kRegisterImages, Percent(sum.images - sum.missing_images, sum.images),
             sum.missing_images == 0
                 ? ""
                 : absl::StrCat(sum.missing_images, " of ", sum.images,
                                " images could not be used, the first: ", sum.missing_reason));
  }
  for (const CameraAlarm& alarm : CameraAlarms(summary))
    AddFinding(verdict, v1::GRADE_USABLE, alarm.text, alarm.remedy);
  // An avatar is for cameras too few to observe the garment.
  if (std::isfinite(summary.coverage) && !job.has_driven())
    AddCheck(verdict, kRegisterCoverage, 100 * summary.coverage);
  return verdict;
}

v1::Verdict AssessJobFolder(const std::string& out_folder, const v1::Job& job) {
  std::vector<std::string> notes;
  return AssessJob(job, ReadJobFrames(out_folder, job, notes).value_or(std::vector<v1::FrameReport>()));
}

}  // namespace weft
