// Which folders a daemon may touch on behalf of its clients.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/confinement/input_links.h"

namespace weft {

// Whether `path` is `folder` or lies below it. Both are canonical.
bool LiesBelow(const std::filesystem::path& path, const std::filesystem::path& folder);

// Compares canonical paths, so neither symbolic links nor `..` lead out. What is exchanged afterwards is up
// to ConfineProcess. Thread safety: const access.
class PathPolicy {
 public:
  // `state_folder` is closed to clients, but for its takes and results; empty: there is none.
  // InvalidArgument: no folder given, or one that does not exist; it is named.
  static absl::StatusOr<PathPolicy> Create(const std::vector<std::string>& allowed,
                                           const std::string& state_folder = "");

  // The canonical path. PermissionDenied: outside the allowed folders, reported before anything about the
  // file, or in or around the state folder, or with links below it that lead there or outside.
  // InvalidArgument: not absolute, or a FIFO, device or socket is there. NotFound: no such file. The message
  // names `field`.
  absl::StatusOr<std::string> CheckInput(const std::string& field, const std::string& path) const;
  // Its two halves: the path itself, and whatever lies at and below a canonical one.
  absl::StatusOr<std::string> CheckInputPath(const std::string& field, const std::string& path) const;
  absl::Status CheckLinks(const std::string& field, const std::string& input) const;
  // The same for a folder that need not exist. InvalidArgument: the state folder is in it.
  absl::StatusOr<std::string> CheckOutput(const std::string& field, const std::string& path) const;

  const std::vector<std::string>& allowed() const { return allowed_; }
  LinkRules links() const { return {.allowed = allowed_, .closed = state_folder_}; }
  // The allowed folders; where the state folder lies in one, what lies around it.
  std::vector<std::string> AllowedButState() const;

 private:
  absl::StatusOr<std::string> Canonical(const std::string& field, const std::string& path) const;

  // Canonical.
  std::vector<std::string> allowed_;
  std::string state_folder_;
};

}  // namespace weft
