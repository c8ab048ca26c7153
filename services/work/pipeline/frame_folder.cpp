#include "services/work/pipeline/frame_folder.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/listed_file.h"

namespace weft {
namespace {

void Unlist(const std::string& name, v1::FrameReport& report) {
  auto& files = *report.mutable_files();
  files.erase(std::remove_if(files.begin(), files.end(),
                             [&name](const v1::ResultFile& f) { return f.name() == name; }),
              files.end());
  auto& meshes = *report.mutable_meshes();
  meshes.erase(std::remove_if(meshes.begin(), meshes.end(),
                              [&name](const v1::FrameMesh& mesh) { return mesh.file() == name; }),
               meshes.end());
}

}  // namespace

absl::StatusOr<FrameFolder> FrameFolder::Open(const std::string& out, const std::string& frame,
                                              ConfinedFolder::IfMissing missing) {
  absl::StatusOr<ConfinedFolder> base = ConfinedFolder::Open(out);
  if (absl::IsNotFound(base.status()) && missing == ConfinedFolder::IfMissing::kMake) {
    WEFT_RETURN_IF_ERROR(CreateFolders(out));
    base = ConfinedFolder::Open(out);
  }
  if (!base.ok()) return base.status();
  WEFT_ASSIGN_OR_RETURN(ConfinedFolder folder, base->Child(frame, missing));
  return FrameFolder(std::move(folder));
}

absl::StatusOr<v1::FrameReport> FrameFolder::Report() const {
  WEFT_ASSIGN_OR_RETURN(const std::string text, folder_.Read(FileName(FrameFile::kReport)));
  v1::FrameReport report;
  const std::string name = folder_.Named(FileName(FrameFile::kReport));
  if (!ParseJson(text, name, report).ok() || report.format_version() != kReportFormat ||
      !MeshesOf(report).ok()) {
    return absl::NotFoundError(absl::StrCat(path(), " holds no complete frame"));
  }
  return report;
}

std::string FrameFolder::Check(FrameFile file, const v1::FrameReport& report) const {
  return CheckNamed(FileName(file), report);
}

std::string FrameFolder::CheckNamed(const std::string& name, const v1::FrameReport& report) const {
  const v1::ResultFile* listed = FindListed(report, name);
  const absl::StatusOr<std::string> bytes = folder_.Read(name);
  if (absl::IsNotFound(bytes.status())) return listed ? absl::StrCat(name, " is missing") : "";
  if (!bytes.ok()) return std::string(bytes.status().message());
  if (!listed) return absl::StrCat(name, " is not of this run");
  const bool same =
      static_cast<int64_t>(bytes->size()) == listed->bytes() && ListedChecksum(*bytes) == listed->checksum();
  return same ? "" : absl::StrCat(name, " is not as it was written");
}

std::string FrameFolder::CheckAll(const v1::FrameReport& report) const {
  for (const FrameFile file : kDataFiles) {
    if (std::string problem = Check(file, report); !problem.empty()) return problem;
  }
  for (const v1::FrameMesh& mesh : report.meshes()) {
    if (FindListed(report, mesh.file()) == nullptr) return absl::StrCat(mesh.file(), " is not listed");
    if (mesh.name() == kGarmentMesh) continue;  // among kDataFiles
    if (std::string problem = CheckNamed(mesh.file(), report); !problem.empty()) return problem;
  }
  return "";
}

absl::Status FrameFolder::Put(FrameFile file, const Writer& write, v1::FrameReport& report) const {
  if (absl::Status status = write(PathOf(file)); !status.ok()) return InWords(status);
  return List(FileName(file), report);
}

absl::Status FrameFolder::Drop(FrameFile file, v1::FrameReport& report) const {
  Unlist(FileName(file), report);
  return folder_.Remove(FileName(file));
}

absl::Status FrameFolder::PutMesh(const std::string& name, size_t vertices, const std::vector<Face>& faces,
                                  const Writer& write, v1::FrameReport& report) const {
  WEFT_RETURN_IF_ERROR(CheckMeshName(name));
  const std::string file = MeshFileName(name);
  if (absl::Status status = write(folder_.At(file)); !status.ok()) return InWords(status);
  WEFT_RETURN_IF_ERROR(List(file, report));
  v1::FrameMesh& mesh = *report.add_meshes();
  mesh.set_name(name);
  mesh.set_file(file);
  mesh.set_topology_hash(TopologyHash(vertices, faces));
  mesh.set_vertices(static_cast<int>(vertices));
  mesh.set_faces(static_cast<int>(faces.size()));
  return absl::OkStatus();
}

absl::Status FrameFolder::DropMesh(const std::string& name, v1::FrameReport& report) const {
  Unlist(MeshFileName(name), report);
  return folder_.Remove(MeshFileName(name));
}

absl::Status FrameFolder::Clear() const {
  const absl::StatusOr<v1::FrameReport> report = Report();
  absl::Status status = folder_.Remove(FileName(FrameFile::kReport));
  if (report.ok())
    for (const v1::FrameMesh& mesh : report->meshes()) status.Update(folder_.Remove(mesh.file()));
  for (const FrameFile file : kDataFiles) status.Update(folder_.Remove(FileName(file)));
  return status;
}

absl::Status FrameFolder::Commit(v1::FrameReport report) const {
  report.set_format_version(kReportFormat);
  return InWords(WriteJsonFile(PathOf(FrameFile::kReport), report));
}

absl::Status FrameFolder::List(const std::string& name, v1::FrameReport& report) const {
  Unlist(name, report);
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, folder_.Read(name));
  v1::ResultFile& entry = *report.add_files();
  entry.set_name(name);
  entry.set_bytes(static_cast<int64_t>(bytes.size()));
  entry.set_checksum(ListedChecksum(bytes));
  return absl::OkStatus();
}

bool Lists(const v1::FrameReport& report, FrameFile file) {
  return FindListed(report, FileName(file)) != nullptr;
}

}  // namespace weft
