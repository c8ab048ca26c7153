#include "services/results/evaluation/comparison_sequence.h"

#include <filesystem>
#include <set>
#include <utility>

#include "evaluation/mesh_difference.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/results/evaluation/frame_pieces.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/job_frames.h"
#include "services/results/report/job_report_parts.h"
#include "services/results/report/picture_data.h"
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

// The mean distance over the frames.
std::optional<v1::PagePicture> StillOf(const JobComparison& comparison) {
  const std::vector<double>& mean_mm = comparison.maps.distance_mm;
  if (mean_mm.empty()) return std::nullopt;
  const absl::StatusOr<std::vector<MeshPicture>> sides =
      DrawBothSides(comparison.a.shape, ScalarColors(mean_mm, DistanceRange(comparison)), 0.6);
  if (!sides.ok() || sides->empty()) return std::nullopt;
  v1::PagePicture still = PictureData(sides->front());
  still.set_title("Mean distance over the frames, on the template");
  return still;
}

}  // namespace

std::optional<v1::PageSequence> ComparisonSequence(const JobComparison& comparison,
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
  v1::PageSequence meshes = ReadSequence(a.result, *reports, sigma_range_mm, {distance}, notes);
  if (meshes.frames_size() == 0) return std::nullopt;
  if (std::optional<v1::PagePicture> still = StillOf(comparison)) *meshes.mutable_still() = *std::move(still);
  return meshes;
}

}  // namespace weft
