// WriteJobReport: from the files of a job's results to report.html.
#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>

#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"
#include "services/files/confined_folder.h"
#include "services/files/frame_paths.h"
#include "services/files/mesh_file.h"
#include "services/report/frame_pictures.h"
#include "services/report/html_report.h"
#include "services/report/job_frames.h"
#include "services/report/job_summary.h"
#include "services/report/read_sequence.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

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

// The first, the worst and the last registered frame, each with the reason why it is shown.
std::vector<std::pair<std::string, std::string>> FramesToPicture(const std::vector<v1::FrameReport>& frames) {
  const v1::FrameReport *first = nullptr, *worst = nullptr, *last = nullptr;
  for (const v1::FrameReport& frame : frames) {
    if (!IsRegistered(frame.state())) continue;
    if (!first) first = &frame;
    if (!worst || frame.mesh().coverage() < worst->mesh().coverage()) worst = &frame;
    last = &frame;
  }
  std::vector<std::pair<std::string, std::string>> chosen;
  if (!first) return chosen;
  const bool first_is_worst = worst == first && last != first;
  chosen.emplace_back(first->frame(), first == last    ? ""
                                      : first_is_worst ? "first frame, lowest coverage"
                                                       : "first frame");
  if (worst != first && worst != last) chosen.emplace_back(worst->frame(), "lowest coverage");
  if (last != first)
    chosen.emplace_back(last->frame(), worst == last ? "last frame, lowest coverage" : "last frame");
  return chosen;
}

std::vector<PicturedMesh> ReadMeshes(const std::string& out_folder,
                                     const std::vector<v1::FrameReport>& frames,
                                     std::vector<std::string>& notes) {
  std::vector<PicturedMesh> meshes;
  for (const auto& [frame, why] : FramesToPicture(frames)) {
    const std::string path = FramePaths(out_folder, frame).Of(FrameFile::kMesh);
    absl::StatusOr<RegisteredMesh> mesh = ReadRegisteredMesh(path);
    absl::StatusOr<TriangleMesh> triangles = mesh.ok() ? ReadMesh(path) : mesh.status();
    if (!triangles.ok()) {
      notes.push_back(absl::StrCat("Frame ", frame, " has no picture: ", triangles.status().message()));
      continue;
    }
    meshes.push_back({frame, why, *std::move(mesh), std::move(triangles->faces)});
  }
  return meshes;
}

}  // namespace

absl::Status WriteJobReport(const std::string& out_folder, const v1::Job& job) {
  std::vector<std::string> notes;
  const absl::StatusOr<std::vector<v1::FrameReport>> frames = ReadJobFrames(out_folder, job, notes);
  if (!frames.ok()) return frames.status();
  NoteOtherFrames(job, frames->size(), notes);
  const std::vector<FramePictures> pictures = DrawFrames(ReadMeshes(out_folder, *frames, notes), notes);
  const ScalarRange sigma_range_mm = pictures.empty() ? ScalarRange() : pictures[0].sigma_range_mm;
  const std::optional<SequenceView> sequence = ReadSequence(out_folder, *frames, sigma_range_mm, notes);
  // Through the open folder: a link that takes its place is not followed.
  const absl::StatusOr<ConfinedFolder> folder = ConfinedFolder::Open(fs::absolute(out_folder).string());
  if (!folder.ok()) return folder.status();
  return folder->InWords(
      WriteFileAtomically(folder->At(kJobReportFile),
                          MakeJobReport(job, *frames, pictures, notes, sequence ? &*sequence : nullptr)));
}

}  // namespace weft
