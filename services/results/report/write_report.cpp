// WriteJobReport: from the files of a job's results to report.html.
#include <algorithm>
#include <filesystem>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/frame_paths.h"
#include "services/results/report/frame_overlays.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/job_frames.h"
#include "services/results/report/job_report.h"
#include "services/results/report/job_report_parts.h"
#include "services/results/report/job_summary.h"
#include "services/results/report/read_sequence.h"

namespace weft {
namespace {

void NoteOtherFrames(const v1::Job& job, size_t reports, std::vector<std::string>& notes) {
  const v1::FrameCounts& counts = job.frames();
  const int64_t finished = int64_t{counts.done()} + counts.degraded() + counts.failed();
  const auto found = static_cast<int64_t>(reports);
  if (counts.total() == 0 || found == finished) return;
  if (found > finished) {
    notes.push_back(absl::StrCat("The folder holds results of ", found, " frames, the job finished ",
                                 finished, "; those of earlier jobs on the same inputs are shown too."));
  } else {
    notes.push_back(absl::StrCat("The job finished ", finished, " frames, the folder holds reports of ",
                                 found, "; the others are missing from plots and tables."));
  }
}

struct ChosenFrame {
  const v1::FrameReport* report;
  std::string why;
};

// What is low in bad frames: the coverage, of driven ones sigma, reversed.
double GoodnessOf(const v1::FrameReport& frame) {
  return frame.has_driven() ? -frame.driven().median_sigma_mm() : frame.mesh().coverage();
}

// Registered frames with the lowest coverage, or the largest sigma, not beside each other; positions in
// `registered`.
std::vector<size_t> WorstFrames(const std::vector<const v1::FrameReport*>& registered) {
  constexpr size_t kMostWorst = 3, kFramesPerWorst = 4, kApartShare = 20;
  const size_t wanted = std::clamp(registered.size() / kFramesPerWorst, size_t{1}, kMostWorst);
  std::vector<size_t> by_goodness(registered.size()), worst;
  std::iota(by_goodness.begin(), by_goodness.end(), size_t{0});
  std::ranges::stable_sort(by_goodness, [&](size_t a, size_t b) {
    return GoodnessOf(*registered[a]) < GoodnessOf(*registered[b]);
  });
  const size_t apart = 1 + registered.size() / kApartShare;
  for (const size_t candidate : by_goodness) {
    const bool is_near = std::ranges::any_of(
        worst, [&](size_t other) { return std::max(candidate, other) - std::min(candidate, other) < apart; });
    if (!is_near && worst.size() < wanted) worst.push_back(candidate);
  }
  return worst;
}

// The first, the worst and the last registered frame, and those of `more`, each with the reason why it is
// shown; in their order.
std::vector<ChosenFrame> FramesToPicture(const std::vector<v1::FrameReport>& frames,
                                         const std::vector<std::pair<std::string, std::string>>& more) {
  std::vector<const v1::FrameReport*> registered;
  for (const v1::FrameReport& frame : frames)
    if (IsRegistered(frame.state())) registered.push_back(&frame);
  std::vector<ChosenFrame> chosen;
  if (registered.empty()) return chosen;
  std::vector<std::vector<std::string>> why(registered.size());
  if (registered.size() > 1) {
    why.front().emplace_back("first frame");
    why.back().emplace_back("last frame");
    const std::vector<size_t> worst = WorstFrames(registered);
    const bool is_driven = registered.front()->has_driven();
    for (size_t i = 0; i < worst.size(); ++i)
      why[worst[i]].emplace_back(is_driven ? (i == 0 ? "largest sigma" : "large sigma")
                                           : (i == 0 ? "lowest coverage" : "low coverage"));
  } else {
    why.front().emplace_back("");
  }
  for (const auto& [name, reason] : more)
    for (size_t i = 0; i < registered.size(); ++i)
      if (registered[i]->frame() == name) why[i].push_back(reason);
  for (size_t i = 0; i < registered.size(); ++i)
    if (!why[i].empty()) chosen.push_back({registered[i], absl::StrJoin(why[i], ", ")});
  return chosen;
}

std::vector<PicturedMesh> ReadMeshes(const std::string& out_folder, const std::vector<ChosenFrame>& chosen,
                                     std::vector<std::string>& notes) {
  std::vector<PicturedMesh> meshes;
  for (const ChosenFrame& frame : chosen) {
    const std::string& name = frame.report->frame();
    const std::string path = FramePaths(out_folder, name).Of(FrameFile::kMesh);
    absl::StatusOr<MeshOfFrame> read = ReadMeshOfFrame(path);
    if (!read.ok()) {
      notes.push_back(absl::StrCat("Frame ", name, " has no picture: ", read.status().message()));
    } else if (!read->registered.state.empty()) {  // pictures are of states and sigmas
      meshes.push_back({name, frame.why, std::move(read->registered), std::move(read->mesh.faces)});
    }
  }
  return meshes;
}

// Takes and rigs of old jobs may be gone; that is no fault of the result.
void AddOverlays(const v1::Job& job, const std::vector<ChosenFrame>& chosen,
                 const std::vector<PicturedMesh>& meshes, std::vector<FramePictures>& pictures,
                 std::vector<std::string>& notes) {
  if (meshes.empty()) return;
  const absl::StatusOr<JobImages> images = JobImages::Open(job);
  if (!images.ok()) {
    if (!absl::IsNotFound(images.status()))
      notes.push_back(absl::StrCat("The report has no images of the cameras: ", images.status().message()));
    return;
  }
  for (FramePictures& picture : pictures)
    for (const PicturedMesh& mesh : meshes)
      for (const ChosenFrame& frame : chosen)
        if (mesh.frame == picture.frame && frame.report->frame() == picture.frame)
          picture.in_images = images->Overlays(*frame.report, mesh);
}

// Images of failed frames, up to three of them, spread evenly.
void AddFailed(const v1::Job& job, const std::vector<v1::FrameReport>& frames,
               std::vector<FramePictures>& pictures) {
  constexpr size_t kMostFailed = 3;
  std::vector<const v1::FrameReport*> failed;
  for (const v1::FrameReport& frame : frames)
    if (frame.state() == v1::FRAME_STATE_FAILED) failed.push_back(&frame);
  if (failed.empty()) return;
  const absl::StatusOr<JobImages> images = JobImages::Open(job);
  if (!images.ok()) return;  // noted with the overlays
  const size_t shown = std::min(failed.size(), kMostFailed);
  for (size_t i = 0; i < shown; ++i) {
    const v1::FrameReport& frame = *failed[i * failed.size() / shown];
    const char* const state = frame.temporal().bridged() ? "failed and bridged" : "failed";
    pictures.push_back({frame.frame(),
                        frame.reason().empty() ? state : absl::StrCat(state, ": ", frame.reason()),
                        {},
                        {},
                        {},
                        images->Plain(frame)});
  }
}

}  // namespace

absl::StatusOr<JobReportParts> ReadJobReportParts(const std::string& out_folder, const v1::Job& job,
                                                  const ReportExtras& extras) {
  JobReportParts parts;
  parts.job = job;
  WEFT_ASSIGN_OR_RETURN(parts.frames, ReadJobFrames(out_folder, job, parts.notes));
  NoteOtherFrames(job, parts.frames.size(), parts.notes);
  const std::vector<ChosenFrame> chosen = FramesToPicture(parts.frames, extras.frames);
  const std::vector<PicturedMesh> meshes = ReadMeshes(out_folder, chosen, parts.notes);
  parts.pictures = DrawFrames(meshes, parts.notes);
  AddOverlays(job, chosen, meshes, parts.pictures, parts.notes);
  const ScalarRange sigma_range_mm =
      parts.pictures.empty() ? ScalarRange() : parts.pictures[0].sigma_range_mm;
  parts.sequence = ReadSequence(out_folder, parts.frames, sigma_range_mm, extras.values, parts.notes);
  AddFailed(job, parts.frames, parts.pictures);
  return parts;
}

absl::Status WriteJobReport(const std::string& out_folder, const v1::Job& job) {
  WEFT_ASSIGN_OR_RETURN(JobReportParts parts, ReadJobReportParts(out_folder, job));
  // Through the open folder: a link that takes its place is not followed.
  WEFT_ASSIGN_OR_RETURN(const ConfinedFolder folder,
                        ConfinedFolder::Open(std::filesystem::absolute(out_folder).string()));
  return folder.InWords(WriteFileAtomically(folder.At(kJobReportFile), MakeJobReport(std::move(parts))));
}

}  // namespace weft
