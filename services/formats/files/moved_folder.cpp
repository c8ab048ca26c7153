#include "services/formats/files/moved_folder.h"

#include <fcntl.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

absl::Status Remove(const std::string& path) {
  std::error_code error;
  fs::remove_all(path, error);
  return error ? WriteError(path, error.value()) : absl::OkStatus();
}

}  // namespace

absl::Status MoveFolder(const std::string& from, const std::string& to) {
  const std::string target_folder = fs::path(to).parent_path();
  WEFT_RETURN_IF_ERROR(CreateFolders(target_folder));
  if (rename(from.c_str(), to.c_str()) != 0) return WriteError(to, errno);
  for (const std::string& folder : {target_folder, fs::path(from).parent_path().string()}) {
    const UniqueFd fd(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    WEFT_RETURN_IF_ERROR(SyncFolder(fd.get(), folder));
  }
  return absl::OkStatus();
}

absl::Status PutAside(const std::string& folder, const std::string& prefix) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) return absl::OkStatus();
  const fs::path place(folder);
  const std::string aside = (place.parent_path() / absl::StrCat(prefix, place.filename().string())).string();
  WEFT_RETURN_IF_ERROR(Remove(aside));
  return MoveFolder(folder, aside);
}

absl::Status RemoveAside(const std::string& parent, const std::string& prefix) {
  absl::Status status;
  std::error_code error;
  for (fs::directory_iterator it(parent, error), end; !error && it != end; it.increment(error)) {
    if (absl::StartsWith(it->path().filename().string(), prefix)) status.Update(Remove(it->path()));
  }
  return status;
}

}  // namespace weft
