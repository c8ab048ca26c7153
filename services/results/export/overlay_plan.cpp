#include "services/results/export/overlay_plan.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/rig_file.h"

namespace weft {
namespace {

absl::StatusOr<std::vector<size_t>> FindCameras(const RecordingChoice& recording, const Rig& rig) {
  std::vector<size_t> found;
  std::vector<std::string> ids;
  for (const CameraModel& camera : rig.cameras) ids.push_back(camera.id);
  for (size_t c = 0; recording.cameras.empty() && c < ids.size(); ++c) found.push_back(c);
  for (const std::string& wanted : recording.cameras) {
    const auto at = std::ranges::find(ids, wanted);
    if (at == ids.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("--camera: the rig has no camera ", wanted, "; it has ", absl::StrJoin(ids, ", ")));
    }
    found.push_back(static_cast<size_t>(at - ids.begin()));
  }
  return found;
}

std::vector<Eigen::Vector3f> OverlayColors(OverlayKind kind, const OverlayPlan& plan,
                                           const ExportMesh& mesh) {
  switch (kind) {
    case OverlayKind::kWireframe:
      return std::vector<Eigen::Vector3f>(mesh.positions.size(), Eigen::Vector3f(0, 1, 1));
    case OverlayKind::kSigma:
      return ScalarColors({mesh.sigma.begin(), mesh.sigma.end()}, plan.sigma_range_mm);
    case OverlayKind::kState:
    case OverlayKind::kNone:
      break;
  }
  std::vector<Eigen::Vector3f> colors;
  for (const uint8_t state : mesh.state) colors.push_back(StateColor(static_cast<VertexState>(state)));
  return colors;
}

}  // namespace

ExportRequest InTheWorld(const ExportScope& scope) {
  ExportRequest world{scope};
  world.up = UpAxis::kY;
  world.world_up = std::string("y");  // GCC 12 warns of the assignment of a letter (bug 105329)
  world.unit = LengthUnit::kMillimetre;
  return world;
}

absl::StatusOr<OverlayPlan> PlanOverlays(const RecordingChoice& recording, ExportSource& source) {
  const v1::Job& job = source.job();
  const std::string rig_file = recording.rig.empty() ? job.spec().rig() : recording.rig;
  const std::string dump = recording.dump.empty() ? job.spec().dump() : recording.dump;
  if (rig_file.empty() || dump.empty())
    return absl::InvalidArgumentError(
        "the result names no take and rig whose pictures could be drawn on; give --take and --rig");
  OverlayPlan plan;
  const std::string of_job[] = {recording.rig.empty() ? job.spec().rig() : "",
                                recording.dump.empty() ? job.spec().dump() : ""};
  for (const std::string& path : of_job) {
    if (path.empty() || std::filesystem::path(path).is_absolute() || std::filesystem::exists(path)) continue;
    return absl::NotFoundError(
        absl::StrCat(path,
                     ": job.json names it as seen from the folder where an earlier Weft ran the job; run "
                     "this there, or give --take and --rig"));
  }
  WEFT_ASSIGN_OR_RETURN(plan.rig, ReadRig(rig_file));
  if (!job.inputs().rig().empty() && plan.rig.ContentHash() != job.inputs().rig()) {
    return absl::FailedPreconditionError(absl::StrCat(rig_file, ": has hash ", plan.rig.ContentHash(),
                                                      ", the result was computed with ", job.inputs().rig(),
                                                      "; give the rig of the job with --rig"));
  }
  const bool is_of_job = dump == job.spec().dump();
  WEFT_ASSIGN_OR_RETURN(plan.dump, OpenDump(dump, plan.rig, is_of_job ? job.spec().options().mosaic() : ""));
  for (size_t i = 0; i < plan.dump->frame_names().size(); ++i)
    plan.index_of_frame[plan.dump->frame_names()[i]] = i;
  for (const size_t frame : source.meshes()) {
    if (plan.index_of_frame.contains(source.frames()[frame].frame())) continue;
    return absl::NotFoundError(absl::StrCat(dump, ": has no frame ", source.frames()[frame].frame(),
                                            "; give the recording of the job with --take"));
  }
  WEFT_ASSIGN_OR_RETURN(plan.cameras, FindCameras(recording, plan.rig));
  WEFT_ASSIGN_OR_RETURN(const ExportMesh first, source.Read(0, ExportSource::Velocities::kLeftOut));
  plan.sigma_range_mm = RoundRange({first.sigma.begin(), first.sigma.end()});
  return plan;
}

absl::StatusOr<OverlayMesh> ReadOverlayMesh(OverlayKind kind, const OverlayPlan& plan, ExportSource& source,
                                            size_t mesh_number) {
  WEFT_ASSIGN_OR_RETURN(const ExportMesh read, source.Read(mesh_number, ExportSource::Velocities::kLeftOut));
  OverlayMesh mesh;
  for (const Eigen::Vector3f& position : read.positions) mesh.vertices_mm.push_back(position.cast<double>());
  mesh.faces = source.topology().faces;
  mesh.colors = OverlayColors(kind, plan, read);
  return mesh;
}

}  // namespace weft
