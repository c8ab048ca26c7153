#include "services/work/pipeline/frame_files.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/pcd/pcd_file.h"
#include "services/work/pipeline/frame_folder.h"

namespace weft {
namespace {

std::vector<ImageObservations> ByImage(const RegistrationInputs& inputs, const FrameResult& frame) {
  std::vector<ImageObservations> images;
  for (const ViewObservations& view : frame.views) {
    images.push_back({inputs.rig.cameras[view.camera].id, view.observations});
  }
  return images;
}

// The frame's own mesh; a frame that stands alone needs it once.
absl::Status PutMeshes(const FrameFolder& folder, const RegistrationInputs& inputs,
                       const std::optional<RegisteredMesh>& mesh, v1::FrameReport& report) {
  const std::vector<Face>& faces = inputs.garment.rest.faces;
  const MeshTexture none;
  const auto with = [&](const MeshTexture* texture) {
    return [&mesh, &faces, texture](const std::string& path) {
      return WriteRegisteredMesh(path, *mesh, faces, *texture);
    };
  };
  if (!mesh) {
    WEFT_RETURN_IF_ERROR(folder.DropMesh(kGarmentMesh, report));
    return folder.Drop(FrameFile::kUnrefined, report);
  }
  WEFT_RETURN_IF_ERROR(
      folder.PutMesh(kGarmentMesh, mesh->vertices_mm.size(), faces, with(&inputs.texture), report));
  if (report.options().frames_alone()) return folder.Drop(FrameFile::kUnrefined, report);
  return folder.Put(FrameFile::kUnrefined, with(&none), report);
}

absl::Status PutCloudPcd(const FrameFolder& folder, const Cloud& cloud, v1::FrameReport& report) {
  const auto write = [&cloud](const std::string& path) {
    return WritePcd(path, CloudAsPly(cloud, CloudColumns::kWithCovariance));
  };
  return folder.Put(FrameFile::kCloudPcd, write, report);
}

// Writes the data files of the frame and lists them in `report`.
absl::Status WriteData(const FrameFolder& folder, const RegistrationInputs& inputs, const FrameResult& frame,
                       v1::FrameReport& report) {
  absl::Status status;
  const auto put = [&](FrameFile file, const FrameFolder::Writer& write) {
    if (status.ok()) status = folder.Put(file, write, report);
  };
  if (report.options().write_observations()) {
    put(FrameFile::kObservations,
        [&](const std::string& path) { return WriteObservations(path, ByImage(inputs, frame)); });
  }
  put(FrameFile::kCloud,
      [&](const std::string& path) { return WriteCloud(path, frame.cloud, CloudColumns::kWithCovariance); });
  if (status.ok() && WantsPcd(report.options())) status = PutCloudPcd(folder, frame.cloud, report);
  if (status.ok()) status = PutMeshes(folder, inputs, frame.mesh, report);
  return status;
}

// Calls `write` with the frame's folder, and again when somebody removed it meanwhile.
template <typename Write>
absl::Status IntoFrameFolder(const std::string& out, const std::string& frame, const Write& write) {
  constexpr int kTries = 5;
  absl::Status status;
  for (int i = 0; i < kTries; ++i) {
    if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const auto folder = FrameFolder::Open(out, frame, ConfinedFolder::IfMissing::kMake);
    status = folder.ok() ? write(*folder) : folder.status();
    if (!absl::IsNotFound(status)) break;
  }
  return status;
}

void RemoveTemporaryFilesOf(const ConfinedFolder& folder, const std::vector<std::string>& files) {
  const auto names = folder.Names();
  if (!names.ok()) return;
  for (const std::string& name : *names) {
    const bool temporary = std::ranges::any_of(
        files, [&name](const std::string& file) { return IsTemporaryNameOf(name, file); });
    if (temporary) folder.Remove(name).IgnoreError();
  }
}

}  // namespace

bool WantsPcd(const v1::RegistrationOptions& options) { return options.cloud_format() == kPcdFormat; }

absl::Status TidyCloudPcd(const FrameFolder& folder, v1::FrameReport& report) {
  const bool stands = folder.Check(FrameFile::kCloudPcd, report).empty();
  if (!WantsPcd(report.options()))
    return stands ? absl::OkStatus() : folder.Drop(FrameFile::kCloudPcd, report);
  if (stands && Lists(report, FrameFile::kCloudPcd)) return absl::OkStatus();
  const absl::StatusOr<Cloud> cloud = ReadCloud(folder.PathOf(FrameFile::kCloud));
  return cloud.ok() ? PutCloudPcd(folder, *cloud, report) : folder.InWords(cloud.status());
}

absl::Status WriteFrame(const std::string& out, const RegistrationInputs& inputs, const FrameResult& frame) {
  return IntoFrameFolder(out, frame.report.frame(), [&](const FrameFolder& folder) {
    WEFT_RETURN_IF_ERROR(folder.Clear());
    v1::FrameReport report = frame.report;
    report.clear_files();
    report.clear_meshes();
    WEFT_RETURN_IF_ERROR(WriteData(folder, inputs, frame, report));
    return folder.Commit(std::move(report));
  });
}

absl::Status ReplaceMeshes(const FrameFolder& folder, const RegistrationInputs& inputs,
                           const std::optional<RegisteredMesh>& mesh, v1::FrameReport report) {
  WEFT_RETURN_IF_ERROR(PutMeshes(folder, inputs, mesh, report));
  return folder.Commit(std::move(report));
}

absl::Status WriteReportAlone(const std::string& out, v1::FrameReport report) {
  report.clear_files();
  report.clear_meshes();
  return IntoFrameFolder(out, report.frame(), [&](const FrameFolder& folder) {
    WEFT_RETURN_IF_ERROR(folder.Clear());
    return folder.Commit(report);
  });
}

void RemoveTemporaryFiles(const std::string& out, const std::vector<std::string>& frames) {
  const auto base = ConfinedFolder::Open(out);
  if (!base.ok()) return;
  RemoveTemporaryFilesOf(*base, {kJobFile, kJobReportFile});
  std::vector<std::string> files = {FileName(FrameFile::kReport)};
  for (const FrameFile file : kDataFiles) files.emplace_back(FileName(file));
  for (const std::string& frame : frames) {
    const auto folder = base->Child(frame, ConfinedFolder::IfMissing::kFail);
    if (folder.ok()) RemoveTemporaryFilesOf(*folder, files);
  }
}

}  // namespace weft
