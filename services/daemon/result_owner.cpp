#include "services/daemon/result_owner.h"

#include <filesystem>

#include "services/callers/owners.h"
#include "services/files/frame_paths.h"
#include "services/files/json_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Empty: nobody's. Whatever else calls itself job.json may be large.
std::string OwnerOfResults(const fs::path& folder) {
  constexpr uintmax_t kLargest_bytes = 4 << 20;
  const fs::path file = folder / kJobFile;
  std::error_code error;
  if (!fs::is_regular_file(file, error) || fs::file_size(file, error) > kLargest_bytes || error) return "";
  v1::Job job;
  return ReadJsonFile(file.string(), job).ok() ? job.submitted_by() : "";
}

absl::Status CheckFolder(const fs::path& folder, const Caller& caller) {
  const std::string owner = OwnerOfResults(folder);
  if (owner.empty()) return absl::OkStatus();
  return CheckMayChange(caller, "spec.out", "the results in " + folder.string(), owner);
}

}  // namespace

absl::Status CheckResultOwner(const v1::Job& job, const std::vector<std::string>& frames,
                              const Caller& caller) {
  const fs::path out = job.spec().out();
  absl::Status status;
  for (fs::path folder = out; folder != folder.root_path(); folder = folder.parent_path())
    status.Update(CheckFolder(folder, caller));
  for (const std::string& frame : frames) {
    if (status.ok()) status = CheckFolder(out / frame, caller);
  }
  return status;
}

}  // namespace weft
