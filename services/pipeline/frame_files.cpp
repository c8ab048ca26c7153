#include "services/pipeline/frame_files.h"

#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"
#include "services/files/cloud_file.h"
#include "services/files/json_file.h"
#include "services/files/mesh_file.h"
#include "services/files/observations_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

absl::Status Remove(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (!error) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat(path.string(), ": cannot replace the file of an earlier run: ", error.message()));
}

std::vector<ImageObservations> ByImage(const RegistrationInputs& inputs, const FrameResult& frame) {
  std::vector<ImageObservations> images;
  for (const ViewObservations& view : frame.views) {
    images.push_back({inputs.rig.cameras[view.camera].id, view.observations});
  }
  return images;
}

}  // namespace

absl::Status WriteFrame(const std::string& folder, const RegistrationInputs& inputs,
                        const FrameResult& frame) {
  if (absl::Status status = CreateFolders(folder); !status.ok()) return status;
  const fs::path base(folder);
  for (const char* name : {"report.json", "mesh.ply", "unrefined.ply", "cloud.ply", "observations.csv"}) {
    if (absl::Status status = Remove(base / name); !status.ok()) return status;
  }
  if (frame.report.options().write_observations()) {
    const absl::Status status =
        WriteObservations((base / "observations.csv").string(), ByImage(inputs, frame));
    if (!status.ok()) return status;
  }
  if (absl::Status status = WriteCloud((base / "cloud.ply").string(), frame.cloud); !status.ok())
    return status;
  if (frame.mesh) {
    const absl::Status status =
        WriteRegisteredMesh((base / "mesh.ply").string(), *frame.mesh, inputs.garment.rest.faces);
    if (!status.ok()) return status;
  }
  if (frame.mesh && !frame.report.options().frames_alone()) {
    const absl::Status status =
        WriteRegisteredMesh((base / "unrefined.ply").string(), *frame.mesh, inputs.garment.rest.faces);
    if (!status.ok()) return status;
  }
  return WriteJsonFile((base / "report.json").string(), frame.report);
}

absl::StatusOr<v1::FrameReport> ReadCompleteReport(const std::string& folder) {
  const fs::path base(folder);
  v1::FrameReport report;
  if (!ReadJsonFile((base / "report.json").string(), report).ok()) {
    return absl::NotFoundError(absl::StrCat(folder, " holds no complete frame"));
  }
  std::error_code error;
  const bool complete =
      report.state() != v1::FRAME_STATE_FAILED && fs::exists(base / "cloud.ply", error) &&
      fs::exists(base / "mesh.ply", error) &&
      (report.options().frames_alone() || fs::exists(base / "unrefined.ply", error)) &&
      (!report.options().write_observations() || fs::exists(base / "observations.csv", error));
  if (!complete) return absl::NotFoundError(absl::StrCat(folder, " lacks files of its report"));
  return report;
}

}  // namespace weft
