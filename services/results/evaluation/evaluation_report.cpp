#include "services/results/evaluation/evaluation_report.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/evaluation/evaluation_measures.h"
#include "services/results/evaluation/evaluation_text.h"
#include "services/results/evaluation/evaluation_verdict.h"
#include "services/results/evaluation/garment_maps.h"
#include "services/results/report/html_text.h"
#include "services/results/report/job_page.h"
#include "services/results/report/job_report_parts.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/page.h"

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

v1::PageMaps MapsOf(const JobEvaluation& evaluation) {
  v1::PageMaps out;
  const VertexMaps& maps = evaluation.maps;
  const char* drift_unit = evaluation.fps > 0 ? "mm/s" : "mm a frame";
  for (const GarmentMap& map :
       {ShareMap("Visibility: share of the frames that observe the vertex", "share", maps.visibility),
        GarmentMap{"Vertex error, mean over the frames", "error", "mm", maps.error_mm,
                   RoundRange(maps.error_mm)},
        GarmentMap{"Geodesic distortion, mean over sources and frames", "distortion", "mm",
                   maps.distortion_mm, RoundRange(maps.distortion_mm)},
        GarmentMap{"Drift by texture flow", "drift", drift_unit, maps.texture_drift,
                   RoundRange(maps.texture_drift)},
        GarmentMap{"Exact drift", "drift", drift_unit, maps.true_drift, RoundRange(maps.true_drift, 0.95)}})
    AddGarmentMap(evaluation.shape, map, out);
  return out;
}

v1::EvaluationPage ShownEvaluation(const JobEvaluation& evaluation) {
  v1::EvaluationPage page;
  page.set_headline(EvaluationHeadline(evaluation));
  for (const EvaluationMeasure& measure : EvaluationMeasures()) {
    v1::EvaluationPage::Measure& shown = *page.add_measures();
    shown.set_name(measure.name);
    shown.set_unit(measure.unit);
    shown.set_decimals(*measure.unit == '\0' ? 0 : measure.decimals);
    shown.set_title(TitleWithUnit(measure));
    shown.set_heading(TitleWithUnit(measure, true));
  }
  const auto fill = [](const EvaluatedFrame& frame, v1::EvaluationPage::Row& row) {
    for (const EvaluationMeasure& measure : EvaluationMeasures())
      row.add_values(measure.value(frame).value_or(kNoNumber));
  };
  fill({"", {}, evaluation.total, evaluation.total_metrics}, *page.mutable_total());
  for (const EvaluatedFrame& frame : evaluation.frames) fill(frame, *page.add_frames());
  return page;
}

}  // namespace

std::string MakeEvaluationReport(const JobEvaluation& evaluation, const JobReportParts* job) {
  const v1::Evaluation message = EvaluationMessage(evaluation);
  const v1::PageMaps maps = MapsOf(evaluation);
  const v1::EvaluationPage shown = ShownEvaluation(evaluation);
  v1::JobPage of_job;
  if (job != nullptr) of_job = JobPageOf(*job);
  return MakePage({.title = "Weft evaluation",
                   .kind = "evaluation",
                   .data = {{"evaluation", &message},
                            {"page", &shown},
                            {"maps", &maps},
                            {"job", job != nullptr ? &of_job : nullptr}}});
}

absl::Status WriteEvaluation(const std::string& folder, const JobEvaluation& evaluation) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ToJson(EvaluationMessage(evaluation)));
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
