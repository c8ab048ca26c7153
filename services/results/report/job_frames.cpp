#include "services/results/report/job_frames.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

bool OtherInputs(const v1::InputHashes& frame, const v1::InputHashes& job) {
  const auto differs = [](const std::string& a, const std::string& b) {
    return !a.empty() && !b.empty() && a != b;
  };
  return differs(frame.rig(), job.rig()) || differs(frame.board(), job.board()) ||
         differs(frame.garment(), job.garment());
}

// Frames that the job was asked for; of older jobs nothing tells which these were.
bool IsAsked(const v1::Job& job, const std::string& frame) {
  if (job.first_frame().empty() || job.last_frame().empty()) return true;
  return !NaturalLess(frame, job.first_frame()) && !NaturalLess(job.last_frame(), frame);
}

}  // namespace

absl::StatusOr<std::vector<v1::FrameReport>> ReadJobFrames(const std::string& out_folder, const v1::Job& job,
                                                           std::vector<std::string>& notes) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> names,
                        ListFrameFolders(out_folder, FrameFile::kReport));
  std::vector<v1::FrameReport> frames;
  int other_inputs = 0, not_asked = 0;
  for (const std::string& name : names) {
    if (!IsAsked(job, name)) {
      ++not_asked;
      continue;
    }
    v1::FrameReport frame;
    if (const absl::Status status = ReadJsonFile(FramePaths(out_folder, name).Of(FrameFile::kReport), frame);
        !status.ok()) {
      notes.push_back(absl::StrCat("Frame ", name, " is missing from this report: ", status.message()));
      continue;
    }
    if (OtherInputs(frame.inputs(), job.inputs())) {
      ++other_inputs;
      continue;
    }
    frame.set_frame(name);
    frames.push_back(std::move(frame));
  }
  if (other_inputs > 0) {
    notes.push_back(absl::StrCat("Results of ", Counted(other_inputs, "frame", "frames"),
                                 " in the folder were computed from another rig, "
                                 "board or template; they are not part of this report."));
  }
  if (not_asked > 0) {
    notes.push_back(absl::StrCat("The folder holds results of ", Counted(not_asked, "frame", "frames"),
                                 " that this job was not asked for; they are not part of this report."));
  }
  return frames;
}

absl::StatusOr<std::vector<std::string>> FramesWithoutReport(const std::string& out_folder,
                                                             const v1::Job& job,
                                                             const std::vector<v1::FrameReport>& reports) {
  std::set<std::string> known, without;
  for (const v1::FrameReport& report : reports) known.insert(report.frame());
  for (const FrameFile file : {FrameFile::kReport, FrameFile::kMesh}) {
    WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListFrameFolders(out_folder, file));
    for (const std::string& name : names)
      if (IsAsked(job, name) && !known.contains(name)) without.insert(name);
  }
  std::vector<std::string> frames(without.begin(), without.end());
  std::ranges::sort(frames, NaturalLess);
  return frames;
}

}  // namespace weft
