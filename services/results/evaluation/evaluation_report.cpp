#include "services/results/evaluation/evaluation_report.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/evaluation/evaluation_sections.h"
#include "services/results/evaluation/evaluation_text.h"
#include "services/results/report/job_report_parts.h"
#include "services/results/report/job_summary.h"
#include "services/results/report/report_sections.h"

namespace weft {

namespace {

constexpr size_t kWorstByError = 2;

std::vector<double> ErrorsAgainst(const JobEvaluation& evaluation, const std::string& frame,
                                  const std::vector<Eigen::Vector3d>& vertices_mm) {
  const absl::StatusOr<TriangleMesh> truth =
      ReadMesh(FramePaths(evaluation.truth, frame).Of(FrameFile::kMesh));
  if (!truth.ok()) return {};
  const std::vector<Eigen::Vector3d> true_mm =
      evaluation.truth_by_node ? evaluation.truth_by_node->Positions(truth->vertices_mm) : truth->vertices_mm;
  if (true_mm.size() != vertices_mm.size()) return {};
  std::vector<double> errors_mm(true_mm.size());
  for (size_t v = 0; v < true_mm.size(); ++v) errors_mm[v] = (vertices_mm[v] - true_mm[v]).norm();
  return errors_mm;
}

// The frames with the largest mean error of well seen vertices.
std::vector<std::pair<std::string, std::string>> WorstByError(const JobEvaluation& evaluation) {
  std::vector<std::pair<double, std::string>> errors;
  for (const EvaluatedFrame& frame : evaluation.frames)
    if (frame.score.mesh)
      if (const auto error = Summarize(frame.score.mesh->visible_mm))
        errors.emplace_back(error->mean, frame.frame);
  std::ranges::stable_sort(errors, [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::pair<std::string, std::string>> worst;
  for (size_t i = 0; i < std::min(errors.size() / 2, kWorstByError); ++i)
    worst.emplace_back(errors[i].second, i == 0 ? "largest error" : "large error");
  return worst;
}

// Empty where the result has no job.json.
absl::StatusOr<std::optional<JobReportParts>> PartsOfJob(const JobEvaluation& evaluation) {
  v1::Job job;
  const absl::Status read = ReadJsonFile((std::filesystem::path(evaluation.result) / kJobFile).string(), job);
  if (absl::IsNotFound(read)) return std::nullopt;
  if (!read.ok()) return read;
  ReportExtras extras;
  extras.frames = WorstByError(evaluation);
  if (!evaluation.maps.error_mm.empty())
    extras.values.push_back({"error", "error", "mm", RoundRange(evaluation.maps.error_mm),
                             [&](const std::string& frame, const std::vector<Eigen::Vector3d>& vertices_mm) {
                               return ErrorsAgainst(evaluation, frame, vertices_mm);
                             }});
  WEFT_ASSIGN_OR_RETURN(JobReportParts parts, ReadJobReportParts(evaluation.result, job, extras));
  return parts;
}

// In front of what was measured: the job, its meshes and pictures.
std::string JobBefore(const JobReportParts& job, const std::string& in_space) {
  return absl::StrCat(JobVerdictSection(job), WarningSection(job.job, job.notes), in_space,
                      PictureSection(job.pictures));
}

std::string JobBehind(const JobReportParts& job) {
  return absl::StrCat(PlotSection(job.frames), FrameSection(job.frames),
                      CameraSection(Summarize(job.job, job.frames)), CellSection(job.frames),
                      AlignmentSection(job.frames), OptionSection(job.job),
                      InputSection(job.job, job.frames));
}

}  // namespace

std::string MakeEvaluationReport(const JobEvaluation& evaluation, const JobReportParts* job) {
  std::string in_space;
  if (job != nullptr && job->sequence) {
    const auto registered = static_cast<size_t>(Summarize(job->job, job->frames).registered);
    in_space = SequenceSection(*job->sequence, job->pictures, registered);
  }
  const std::string body =
      absl::StrCat(EvaluationHead(evaluation), PaperSection(FiguresOf(evaluation)),
                   job ? JobBefore(*job, in_space) : "", MapSection(evaluation),
                   VisibilitySection(evaluation), FramePlotSection(evaluation), FrameTableSection(evaluation),
                   CameraTableSection(evaluation), job ? JobBehind(*job) : "", RemarkSection(evaluation));
  if (in_space.empty()) return Page("Weft evaluation", body);
  return Page("Weft evaluation", body, SequenceProgram(*job->sequence));
}

absl::Status WriteEvaluation(const std::string& folder, const JobEvaluation& evaluation) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, EvaluationJson(evaluation));
  WEFT_ASSIGN_OR_RETURN(const std::optional<JobReportParts> job, PartsOfJob(evaluation));
  absl::Status status = CreateFolders(folder);
  const auto write = [&](const char* name, const std::string& text) {
    if (status.ok()) status = WriteFileAtomically((std::filesystem::path(folder) / name).string(), text);
  };
  write("frames.csv", FrameCsv(evaluation));
  write("cameras.csv", CameraCsv(evaluation));
  write("evaluation.json", json);
  write("report.html", MakeEvaluationReport(evaluation, job ? &*job : nullptr));
  return status;
}

}  // namespace weft
