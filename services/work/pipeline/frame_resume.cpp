#include "services/work/pipeline/frame_resume.h"

#include <utility>

#include "base/status_macros.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/pipeline/frame_files.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/frame_inputs.h"
#include "services/work/pipeline/frame_neighbors.h"
#include "services/work/pipeline/frame_stages.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

// The file with the frame's own mesh.
FrameFile OwnMeshOf(const v1::FrameReport& report) {
  return report.options().frames_alone() ? FrameFile::kMesh : FrameFile::kUnrefined;
}

// The first stage whose files do not stand, by themselves.
std::optional<StageDifference> FirstDamage(const FrameFolder& folder, const v1::FrameReport& report,
                                           const v1::RegistrationOptions& wanted) {
  if (wanted.write_observations() && !Lists(report, FrameFile::kObservations)) {
    return StageDifference{Stage::kDecode, "observations.csv was not written"};
  }
  const std::pair<FrameFile, Stage> files[] = {
      {FrameFile::kObservations, Stage::kDecode}, {FrameFile::kCloud, Stage::kDecode},
      {OwnMeshOf(report), Stage::kAlign},         {FrameFile::kMesh, Stage::kRefine},
      {FrameFile::kUnrefined, Stage::kRefine},    {FrameFile::kCloudPcd, Stage::kRefine}};
  for (const auto& [file, stage] : files) {
    if (std::string problem = folder.Check(file, report); !problem.empty()) {
      return StageDifference{stage, std::move(problem)};
    }
  }
  if (WantsPcd(wanted) && !Lists(report, FrameFile::kCloudPcd)) {
    return StageDifference{Stage::kRefine, "cloud.pcd was not written"};
  }
  return std::nullopt;
}

// Alignment from a cloud with its covariances, which files up to version 0.1.2 lack, and refinement begin
// with files; all other stages with the images.
Stage Restart(Stage first) { return first < Stage::kAlign ? Stage::kDecode : first; }

absl::StatusOr<FrameFolder> OpenFrame(const RegistrationInputs& inputs, size_t index,
                                      const std::string& out) {
  return FrameFolder::Open(out, inputs.dump->frame_names()[index], ConfinedFolder::IfMissing::kFail);
}

double TotalMs(const v1::FrameReport& report) {
  double total_ms = 0;
  for (const v1::StageTime& stage : report.stages()) total_ms += stage.time_ms();
  return total_ms;
}

absl::StatusOr<v1::FrameReport> AlignAgain(const RegistrationInputs& inputs, size_t index,
                                           const JobOptions& options, const std::string& out,
                                           const v1::FrameReport& earlier, const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(const FrameFolder folder, OpenFrame(inputs, index, out));
  absl::StatusOr<Cloud> cloud = ReadCloud(folder.PathOf(FrameFile::kCloud));
  if (!cloud.ok()) return folder.InWords(cloud.status());
  FrameResult frame{.report = earlier, .views = {}, .cloud = *std::move(cloud), .mesh = {}};
  const FrameOptions frame_options{options.pipeline, options.message.scans(), options.message.starts()};
  WEFT_RETURN_IF_ERROR(AlignFrame(inputs, index, frame_options, stop, frame));
  frame.report.clear_temporal();
  frame.report.set_total_ms(TotalMs(frame.report));
  SignReport(inputs, options.message, frame.report);
  WEFT_RETURN_IF_ERROR(TidyCloudPcd(folder, frame.report));
  WEFT_RETURN_IF_ERROR(ReplaceMeshes(folder, inputs, frame.mesh, frame.report));
  return std::move(frame.report);
}

// Back to the frame's own mesh, for the refinement to begin with.
absl::StatusOr<v1::FrameReport> RefineAgain(const RegistrationInputs& inputs, size_t index,
                                            const JobOptions& options, const std::string& out,
                                            v1::FrameReport report) {
  WEFT_ASSIGN_OR_RETURN(const FrameFolder folder, OpenFrame(inputs, index, out));
  const absl::StatusOr<RegisteredMesh> mesh = ReadRegisteredMesh(folder.PathOf(OwnMeshOf(report)));
  if (!mesh.ok()) return folder.InWords(mesh.status());
  report.clear_temporal();
  SignReport(inputs, options.message, report);
  WEFT_RETURN_IF_ERROR(TidyCloudPcd(folder, report));
  WEFT_RETURN_IF_ERROR(ReplaceMeshes(folder, inputs, *mesh, report));
  return report;
}

}  // namespace

CachedStages InspectFrame(const RegistrationInputs& inputs, size_t index, const JobOptions& options,
                          const std::string& out) {
  const absl::StatusOr<FrameFolder> folder = OpenFrame(inputs, index, out);
  if (!folder.ok()) return {};
  absl::StatusOr<v1::FrameReport> report = folder->Report();
  if (!report.ok() || report->frame() != inputs.dump->frame_names()[index] || !FactsOf(*report).registered) {
    return {};
  }
  const absl::StatusOr<std::string> fingerprint = FrameFingerprint(*inputs.dump, index, options.message);
  if (!fingerprint.ok()) return {};
  std::optional<StageDifference> first;
  if (report->images_fingerprint() != *fingerprint) {
    first = {Stage::kDecode, "its images, scan or start changed"};
  } else {
    first = FirstDifference(report->keys(), KeysOf(inputs.hashes, options.message));
  }
  if (!first || Restart(first->first) != Stage::kDecode) {
    const auto damage = FirstDamage(*folder, *report, options.message);
    if (damage && (!first || damage->first < first->first)) first = damage;
  }
  // Whoever wrote it may have been killed before that.
  if (!first && folder->Sync().ok()) return {std::nullopt, "", *std::move(report)};
  if (!first) return {};
  return {Restart(first->first), first->why, *std::move(report)};
}

absl::StatusOr<v1::FrameReport> ResumeFrom(const CachedStages& standing, const RegistrationInputs& inputs,
                                           size_t index, const JobOptions& options, const std::string& out,
                                           const FrameProgress& progress, std::stop_token stop) {
  absl::StatusOr<v1::FrameReport> report = absl::NotFoundError("nothing stands");
  if (standing.redo == Stage::kAlign) {
    report = AlignAgain(inputs, index, options, out, standing.report, stop);
  } else if (standing.redo == Stage::kRefine) {
    report = RefineAgain(inputs, index, options, out, standing.report);
  }
  // So it is as well where a file vanished after it was looked at.
  if (absl::IsNotFound(report.status())) {
    return RegisterFrame(inputs, index, options, out, progress, std::move(stop));
  }
  if (report.ok() && progress) progress(1);
  return report;
}

}  // namespace weft
