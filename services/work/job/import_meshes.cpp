#include "services/work/job/import_meshes.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "alignment/garment_mesh.h"
#include "base/host_clock.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "capture/take/frame_number.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/files/garment_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/obj_file.h"
#include "services/work/pipeline/frame_folder.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr char kImportedId[] = "import";  // of results that no job computed
constexpr char kGarmentFile[] = "garment.ply";
// Exports hold numbers of 32 bits, which are 1/128 mm apart this far from the origin.
constexpr double kFarthest_mm = 100'000;

std::string AbsolutePath(const std::string& path) { return fs::absolute(path).lexically_normal().string(); }

// By the numbers that the names of the files differ in, as programs count frames; by position without.
std::vector<std::string> FrameNamesOf(const std::vector<std::string>& meshes) {
  std::vector<std::string> stems;
  for (const std::string& mesh : meshes) stems.push_back(fs::path(mesh).stem().string());
  if (const std::optional<NumbersInNames> found = FindNumbers(stems))
    if (std::set<std::string>(found->numbers.begin(), found->numbers.end()).size() == stems.size())
      return found->numbers;
  std::vector<std::string> names;
  for (size_t i = 0; i < meshes.size(); ++i) names.push_back(absl::StrFormat("%04d", i));
  return names;
}

// A result of a job is not written over; another import is.
absl::Status MayWrite(const std::string& out) {
  v1::Job there;
  const std::string file = (fs::path(out) / kJobFile).string();
  const absl::Status status = ReadJsonFile(file, there);
  if (absl::IsNotFound(status) || (status.ok() && there.id() == kImportedId)) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(out, ": holds the result of a job; choose another folder with --out"));
}

void Turn(const Eigen::Matrix3d& world_from_mesh, std::vector<Eigen::Vector3d>& vertices_mm) {
  if (world_from_mesh.isIdentity(0)) return;
  for (Eigen::Vector3d& v : vertices_mm) v = world_from_mesh * v;
}

absl::Status CheckReach(const std::string& path, const std::vector<Eigen::Vector3d>& vertices_mm) {
  for (size_t v = 0; v < vertices_mm.size(); ++v)
    if (!(vertices_mm[v].cwiseAbs().maxCoeff() <= kFarthest_mm))
      return absl::InvalidArgumentError(
          absl::StrFormat("%s: vertex %d is %.0f m from the origin, where results of 32 bits are coarse; "
                          "move the mesh nearer than %.0f m, or give its unit with --unit",
                          path, v + (IsObjName(path) ? 1 : 0), vertices_mm[v].cwiseAbs().maxCoeff() / 1000,
                          kFarthest_mm / 1000));
  return absl::OkStatus();
}

class MeshImporter {
 public:
  MeshImporter(std::string out, GarmentMesh garment)
      : out_(std::move(out)), garment_(std::move(garment)), hash_(garment_.MeshHash()) {}

  absl::Status WriteFrame(const std::string& frame, std::vector<Eigen::Vector3d> vertices_mm) const {
    WEFT_ASSIGN_OR_RETURN(FrameFolder folder,
                          FrameFolder::Open(out_, frame, ConfinedFolder::IfMissing::kMake));
    WEFT_RETURN_IF_ERROR(folder.Clear());
    v1::FrameReport report;
    report.set_frame(frame);
    report.set_state(v1::FRAME_STATE_DONE);
    report.mutable_inputs()->set_garment(hash_);
    report.mutable_mesh()->set_vertices(static_cast<int>(vertices_mm.size()));
    report.set_weft_version(WEFT_VERSION);
    const TriangleMesh mesh = {std::move(vertices_mm), garment_.rest.faces};
    WEFT_RETURN_IF_ERROR(folder.PutMesh(
        kGarmentMesh, mesh.vertices_mm.size(), mesh.faces,
        [&](const std::string& path) { return WriteMesh(path, mesh, garment_.texture); }, report));
    return folder.Commit(std::move(report));
  }

  // Until it is whole, the folder is nobody's result.
  absl::Status Begin() const {
    std::error_code error;
    const std::string job = (fs::path(out_) / kJobFile).string();
    fs::remove(job, error);
    return error ? WriteError(job, error.value()) : absl::OkStatus();
  }

  // Frames of an earlier import.
  absl::Status RemoveOthers(const std::vector<std::string>& frames) const {
    WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> there, ListFrameFolders(out_));
    for (const std::string& frame : there) {
      if (std::find(frames.begin(), frames.end(), frame) != frames.end()) continue;
      WEFT_ASSIGN_OR_RETURN(const FrameFolder folder,
                            FrameFolder::Open(out_, frame, ConfinedFolder::IfMissing::kFail));
      WEFT_RETURN_IF_ERROR(folder.Clear());
    }
    return absl::OkStatus();
  }

  absl::Status Finish(const std::vector<std::string>& frames, int64_t started_unix_ns) const {
    WEFT_RETURN_IF_ERROR(WriteMesh(GarmentPath(), garment_.rest, garment_.texture));
    v1::Job job;
    job.set_id(kImportedId);
    job.mutable_spec()->set_garment(GarmentPath());
    job.mutable_spec()->set_out(out_);
    job.mutable_inputs()->set_garment(hash_);
    job.set_state(v1::JOB_STATE_DONE);
    const int count = static_cast<int>(frames.size());
    job.mutable_frames()->set_total(count);
    job.mutable_frames()->set_done(count);
    job.set_first_frame(frames.front());
    job.set_last_frame(frames.back());
    job.set_created_unix_ns(started_unix_ns);
    job.set_started_unix_ns(started_unix_ns);
    job.set_finished_unix_ns(HostTime_ns());
    job.set_weft_version(WEFT_VERSION);
    return WriteJsonFile((fs::path(out_) / kJobFile).string(), job);
  }

  std::string GarmentPath() const { return (fs::path(out_) / kGarmentFile).string(); }

 private:
  const std::string out_;
  const GarmentMesh garment_;
  const std::string hash_;
};

}  // namespace

absl::Status MeshImport::Validate() const {
  if (meshes.empty()) return absl::InvalidArgumentError("give the mesh of a frame, or of several");
  if (out.empty()) return absl::InvalidArgumentError("the folder to write to is empty");
  if (!(unit_mm > 0)) return absl::InvalidArgumentError("the unit of the meshes must be positive");
  std::set<std::string> seen;
  for (const std::string& mesh : meshes) {
    if (!IsMeshName(mesh))
      return absl::InvalidArgumentError(absl::StrCat(mesh, ": is neither .obj nor .ply"));
    if (!seen.insert(mesh).second) return absl::InvalidArgumentError(absl::StrCat(mesh, ": is given twice"));
  }
  return absl::OkStatus();
}

absl::StatusOr<ImportedGarment> ImportMeshes(const MeshImport& request,
                                             const std::function<void(size_t, size_t)>& progress,
                                             const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(request.Validate());
  const int64_t started_unix_ns = HostTime_ns();
  std::vector<std::string> meshes = request.meshes;
  std::sort(meshes.begin(), meshes.end(), NaturalLess);
  const std::string out = AbsolutePath(request.out);
  WEFT_RETURN_IF_ERROR(MayWrite(out));
  const std::string& rest = request.rest.empty() ? meshes.front() : request.rest;
  WEFT_ASSIGN_OR_RETURN(GarmentMesh garment, ReadGarmentMesh(rest, request.unit_mm));
  Turn(request.world_from_mesh, garment.rest.vertices_mm);
  WEFT_RETURN_IF_ERROR(CheckReach(rest, garment.rest.vertices_mm));
  ImportedGarment imported;
  imported.frames = FrameNamesOf(meshes);
  imported.vertices = garment.rest.vertices_mm.size(), imported.faces = garment.rest.faces.size();
  const MeshImporter importer(out, garment);
  imported.garment = importer.GarmentPath();
  const auto read = [&](size_t i) -> absl::StatusOr<std::vector<Eigen::Vector3d>> {
    if (stop.stop_requested()) return absl::CancelledError("stopped; the same command begins again");
    WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> vertices_mm,
                          ReadGarmentMoment(meshes[i], garment, request.unit_mm));
    Turn(request.world_from_mesh, vertices_mm);
    WEFT_RETURN_IF_ERROR(CheckReach(meshes[i], vertices_mm));
    return vertices_mm;
  };
  const size_t all = meshes.size();
  // All are read before the first is written, so that a bad one leaves an earlier import as it was.
  for (size_t i = 0; i < all; ++i) {
    WEFT_RETURN_IF_ERROR(read(i).status());
    if (progress) progress((i + 1) / 2, all);
  }
  WEFT_RETURN_IF_ERROR(CreateFolders(out));
  WEFT_RETURN_IF_ERROR(importer.Begin());
  for (size_t i = 0; i < all; ++i) {
    WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> vertices_mm, read(i));
    WEFT_RETURN_IF_ERROR(importer.WriteFrame(imported.frames[i], std::move(vertices_mm)));
    if (progress) progress((all + i + 1) / 2, all);
  }
  WEFT_RETURN_IF_ERROR(importer.RemoveOthers(imported.frames));
  WEFT_RETURN_IF_ERROR(importer.Finish(imported.frames, started_unix_ns));
  return imported;
}

}  // namespace weft
