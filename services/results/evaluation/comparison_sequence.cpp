#include "services/results/evaluation/comparison_sequence.h"

#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "evaluation/mesh_difference.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/results/evaluation/frame_pieces.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/html_text.h"
#include "services/results/report/job_frames.h"
#include "services/results/report/job_report_parts.h"
#include "services/results/report/job_summary.h"
#include "services/results/report/read_sequence.h"

namespace weft {
namespace {

// The last colour is for what 95 of 100 vertices stay below in nearly every frame.
ScalarRange DistanceRange(const JobComparison& comparison) {
  std::vector<double> p95_mm;
  for (const FrameDifference& frame : comparison.frames)
    if (frame.distance_mm) p95_mm.push_back(frame.distance_mm->p95);
  return RoundRange(std::move(p95_mm));
}

std::vector<double> DistancesInFrame(const std::string& b, const std::string& frame,
                                     const std::vector<Eigen::Vector3d>& a_mm) {
  const absl::StatusOr<ResultMesh> of_b = ReadResultMesh(FramePaths(b, frame).Of(FrameFile::kMesh));
  if (!of_b.ok() || of_b->mesh.vertices_mm.size() != a_mm.size()) return {};
  return DifferenceOf(a_mm, of_b->mesh.vertices_mm, {}, {}).distance_mm;
}

}  // namespace

std::optional<SequenceView> ComparisonSequence(const JobComparison& comparison,
                                               std::vector<std::string>& notes) {
  const JobEvaluation &a = comparison.a, &b = comparison.b;
  if (!comparison.total.distance_mm || a.shape.faces != b.shape.faces) return std::nullopt;
  v1::Job job;
  if (!ReadJsonFile((std::filesystem::path(a.result) / kJobFile).string(), job).ok()) return std::nullopt;
  absl::StatusOr<std::vector<v1::FrameReport>> reports = ReadJobFrames(a.result, job, notes);
  if (!reports.ok()) return std::nullopt;
  std::set<std::string> compared;
  for (const EvaluatedFrame& frame : a.frames) compared.insert(frame.frame);
  std::erase_if(*reports, [&](const v1::FrameReport& report) { return !compared.contains(report.frame()); });
  ScalarRange sigma_range_mm;
  for (const v1::FrameReport& report : *reports) {
    const auto mesh = ReadResultMesh(FramePaths(a.result, report.frame()).Of(FrameFile::kMesh));
    if (!mesh.ok()) continue;
    sigma_range_mm = RoundRange(mesh->sigma_mm);
    break;
  }
  const VertexValues distance{
      "distance of A and B",
      "distance",
      "mm",
      DistanceRange(comparison),
      [&b](const std::string& frame, const std::vector<Eigen::Vector3d>& vertices_mm) {
        return DistancesInFrame(b.result, frame, vertices_mm);
      },
      true};
  return ReadSequence(a.result, *reports, sigma_range_mm, {distance}, notes);
}

std::string ComparisonSequenceSection(const JobComparison& comparison, const SequenceView& sequence,
                                      const std::vector<std::string>& notes) {
  MeshPicture still;
  if (const std::vector<double>& mean_mm = comparison.maps.distance_mm; !mean_mm.empty()) {
    const absl::StatusOr<std::vector<MeshPicture>> sides =
        DrawBothSides(comparison.a.shape, ScalarColors(mean_mm, DistanceRange(comparison)), 0.6);
    if (sides.ok() && !sides->empty()) {
      still = sides->front();
      still.title = "Mean distance over the frames, on the template";
    }
  }
  const auto count = [](size_t number) { return FormatCount(static_cast<int64_t>(number)); };
  std::string about = absl::StrCat("Meshes of A, ", count(sequence.kept().size()), " of their vertices in ",
                                   count(sequence.frames()), " of ", count(comparison.a.frames.size()),
                                   " frames; grey: not measured in both.");
  for (const std::string& note : notes) absl::StrAppend(&about, " ", EscapeHtml(note));
  return sequence.Section(still, about);
}

}  // namespace weft
