#include "services/tools/client/fetch_results.h"

#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/frame_paths.h"
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
                          v1::ResultKind kind, const ConfinedFolder& folder) {
  const absl::Status status = client.Fetch(job_id, frame, kind, folder.At(ResultFileName(kind)));
  return absl::IsNotFound(status) ? absl::OkStatus() : folder.InWords(status);
}

// Made where it is missing. What it is reached by may hold links, what it holds may not.
absl::StatusOr<ConfinedFolder> OpenOut(const std::string& out) {
  if (absl::Status status = CreateFolders(out); !status.ok()) return status;
  std::error_code error;
  const std::string canonical = std::filesystem::canonical(out, error).string();
  if (error) return absl::NotFoundError(absl::StrCat(out, ": no such folder (", error.message(), ")"));
  return ConfinedFolder::Open(canonical);
}

}  // namespace

absl::Status FetchResults(RegistrationClient& client, const v1::Job& job, const std::string& out,
                          const std::function<void(size_t done, size_t total)>& progress,
                          std::stop_token stop) {
  const absl::StatusOr<std::vector<v1::FrameInfo>> frames = client.Frames(job.id());
  if (!frames.ok()) return frames.status();
  const absl::StatusOr<ConfinedFolder> base = OpenOut(out);
  if (!base.ok()) return base.status();
  size_t done = 0;
  for (const v1::FrameInfo& frame : *frames) {
    if (stop.stop_requested()) return absl::CancelledError("stopped while the results were fetched");
    if (HasFiles(frame)) {
      if (absl::Status status = CheckFrameName(frame.frame()); !status.ok()) return status;
      const auto folder = base->Child(frame.frame(), ConfinedFolder::IfMissing::kMake);
      if (!folder.ok()) return folder.status();
      std::vector<v1::ResultKind> kinds = {v1::RESULT_KIND_OBSERVATIONS, v1::RESULT_KIND_CLOUD};
      // Only where it was asked for: earlier daemons refuse this kind.
      if (job.spec().options().cloud_format() == "pcd") kinds.push_back(v1::RESULT_KIND_CLOUD_PCD);
      kinds.insert(kinds.end(), {v1::RESULT_KIND_MESH, v1::RESULT_KIND_FRAME_REPORT});
      for (const v1::ResultKind kind : kinds) {
        if (absl::Status status = FetchIfThere(client, job.id(), frame.frame(), kind, *folder); !status.ok())
          return status;
      }
    }
    if (progress) progress(++done, frames->size());
  }
  for (const v1::ResultKind kind : {v1::RESULT_KIND_JOB_REPORT, v1::RESULT_KIND_JOB}) {
    if (absl::Status status = FetchIfThere(client, job.id(), "", kind, *base); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace weft
