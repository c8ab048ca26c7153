// A folder that no symbolic link leads out of, however names change while it is open.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// Files are reached through the open folder, so a link or another folder that takes its place later is not
// followed. Names are without "/". Thread safety: const access.
class ConfinedFolder {
 public:
  // `path` is absolute; a link anywhere in it is an error. NotFound: no such folder. FailedPrecondition: a
  // link or a file is in the way; it is named. PermissionDenied.
  static absl::StatusOr<ConfinedFolder> Open(const std::string& path);

  enum class IfMissing { kFail, kMake };
  // A folder directly in this one. Errors as Open, and those of WriteFileAtomically where it is to be made.
  absl::StatusOr<ConfinedFolder> Child(const std::string& name, IfMissing missing) const;

  // The same open folder, which lives as long as the copy. ResourceExhausted.
  absl::StatusOr<ConfinedFolder> Again() const;

  // What people call the folder, and a file in it.
  const std::string& path() const { return path_; }
  std::string Named(const std::string& name) const { return path_ + "/" + name; }
  // The same file for programs: a path through the descriptor, valid while this object lives. A link of that
  // name would be followed by readers; writers replace it (WriteFileAtomically).
  std::string At(const std::string& name) const;
  // A message about At(...) as one about Named(...).
  absl::Status InWords(const absl::Status& status) const;

  // Opens a plain file below the folder for reading; `path` may have several parts. No link is followed at
  // any of them, whatever is exchanged meanwhile. NotFound. FailedPrecondition: a link, or something else
  // than a file; it is named. InvalidArgument: "..", or no name. PermissionDenied. ResourceExhausted.
  absl::StatusOr<UniqueFd> OpenFile(const std::string& path) const;
  // The whole file. NotFound where there is none, or no plain file: links are not followed.
  absl::StatusOr<std::string> Read(const std::string& name) const;
  // Removes a file, or a link and not what it leads to. Not there: no error.
  absl::Status Remove(const std::string& name) const;
  // Names of everything in it, unordered.
  absl::StatusOr<std::vector<std::string>> Names() const;
  // Names made, replaced and removed so far are on the disk. Unavailable.
  absl::Status Sync() const;

 private:
  ConfinedFolder(UniqueFd fd, std::string path) : fd_(std::move(fd)), path_(std::move(path)) {}

  UniqueFd fd_;
  std::string path_;
};

}  // namespace weft
