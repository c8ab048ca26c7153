#include "services/tools/client/fetch_results.h"

#include <filesystem>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/frame_meshes.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/listed_file.h"
#include "services/server/rpc/result_names.h"

namespace weft {
namespace {

bool HasFiles(const v1::FrameInfo& frame) {
  return frame.state() == v1::FRAME_STATE_DONE || frame.state() == v1::FRAME_STATE_DEGRADED ||
         frame.state() == v1::FRAME_STATE_FAILED;
}

// A frame's name becomes a folder here, so a daemon must not be able to choose one elsewhere.
absl::Status CheckFrameName(const std::string& name) {
  if (!name.empty() && name != "." && name != ".." && name.find('/') == std::string::npos) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat("the daemon names a frame \"", name, "\", which is no name"));
}

absl::Status FetchIfThere(RegistrationClient& client, const std::string& job_id, const std::string& frame,
                          v1::ResultKind kind, const ConfinedFolder& folder, const std::string& mesh = "") {
  const std::string file = mesh.empty() ? ResultFileName(kind) : MeshFileName(mesh);
  const absl::Status status = client.Fetch(job_id, frame, kind, folder.At(file), mesh);
  return absl::IsNotFound(status) ? absl::OkStatus() : folder.InWords(status);
}

// The report that came, as far as this version reads it: later daemons may say more.
std::optional<v1::FrameReport> FetchedReport(const ConfinedFolder& folder) {
  const std::string file = FileName(FrameFile::kReport);
  const absl::StatusOr<std::string> json = folder.Read(file);
  v1::FrameReport report;
  if (!json.ok() || !ParseJson(*json, folder.Named(file), report).ok()) return std::nullopt;
  return report;
}

// The meshes of a frame that its report names beside the garment. The report is untrusted.
absl::Status FetchOtherMeshes(RegistrationClient& client, const std::string& job_id, const std::string& frame,
                              const v1::FrameReport& report, const ConfinedFolder& folder) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameMesh> meshes, MeshesOf(report));
  for (const v1::FrameMesh& mesh : meshes)
    if (mesh.name() != kGarmentMesh)
      WEFT_RETURN_IF_ERROR(FetchIfThere(client, job_id, frame, v1::RESULT_KIND_MESH, folder, mesh.name()));
  return absl::OkStatus();
}

// What was damaged on the daemon's disk, or written anew while it was fetched.
absl::Status CheckFetched(const v1::FrameReport& report, const ConfinedFolder& folder) {
  for (const v1::ResultFile& listed : report.files()) {
    const absl::StatusOr<std::string> bytes = folder.Read(listed.name());
    if (absl::IsNotFound(bytes.status())) continue;  // it was not asked for
    WEFT_RETURN_IF_ERROR(bytes.status());
    WEFT_RETURN_IF_ERROR(CheckListed(report, listed.name(), *bytes, folder.Named(listed.name())));
  }
  return absl::OkStatus();
}

// Made where it is missing. What it is reached by may hold links, what it holds may not.
absl::StatusOr<ConfinedFolder> OpenOut(const std::string& out) {
  WEFT_RETURN_IF_ERROR(CreateFolders(out));
  std::error_code error;
  const std::string canonical = std::filesystem::canonical(out, error).string();
  if (error) return absl::NotFoundError(absl::StrCat(out, ": no such folder (", error.message(), ")"));
  return ConfinedFolder::Open(canonical);
}

}  // namespace

absl::Status FetchResults(RegistrationClient& client, const v1::Job& job, const std::string& out,
                          const std::function<void(size_t done, size_t total)>& progress,
                          std::stop_token stop) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameInfo> frames, client.Frames(job.id()));
  WEFT_ASSIGN_OR_RETURN(const ConfinedFolder base, OpenOut(out));
  size_t done = 0;
  for (const v1::FrameInfo& frame : frames) {
    if (stop.stop_requested()) return absl::CancelledError("stopped while the results were fetched");
    if (HasFiles(frame)) {
      WEFT_RETURN_IF_ERROR(CheckFrameName(frame.frame()));
      WEFT_ASSIGN_OR_RETURN(const auto folder, base.Child(frame.frame(), ConfinedFolder::IfMissing::kMake));
      std::vector<v1::ResultKind> kinds = {v1::RESULT_KIND_OBSERVATIONS, v1::RESULT_KIND_CLOUD};
      // Only where it was asked for: earlier daemons refuse this kind.
      if (job.spec().options().cloud_format() == "pcd") kinds.push_back(v1::RESULT_KIND_CLOUD_PCD);
      kinds.insert(kinds.end(), {v1::RESULT_KIND_MESH, v1::RESULT_KIND_FRAME_REPORT});
      for (const v1::ResultKind kind : kinds) {
        const std::string mesh = kind == v1::RESULT_KIND_MESH ? kGarmentMesh : "";
        WEFT_RETURN_IF_ERROR(FetchIfThere(client, job.id(), frame.frame(), kind, folder, mesh));
      }
      if (const std::optional<v1::FrameReport> report = FetchedReport(folder)) {
        WEFT_RETURN_IF_ERROR(FetchOtherMeshes(client, job.id(), frame.frame(), *report, folder));
        WEFT_RETURN_IF_ERROR(CheckFetched(*report, folder));
      }
    }
    if (progress) progress(++done, frames.size());
  }
  for (const v1::ResultKind kind : {v1::RESULT_KIND_JOB_REPORT, v1::RESULT_KIND_JOB}) {
    WEFT_RETURN_IF_ERROR(FetchIfThere(client, job.id(), "", kind, base));
  }
  return absl::OkStatus();
}

}  // namespace weft
