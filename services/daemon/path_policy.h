// Which folders a daemon may touch on behalf of its clients.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// Whether `path` is `folder` or lies below it. Both are canonical.
bool LiesBelow(const std::filesystem::path& path, const std::filesystem::path& folder);

// Compares canonical paths, so neither symbolic links nor `..` lead out. Thread safety: const access.
class PathPolicy {
 public:
  // InvalidArgument: no folder given, or one that does not exist; it is named.
  static absl::StatusOr<PathPolicy> Create(const std::vector<std::string>& allowed);

  // The canonical path. PermissionDenied: outside the allowed folders, reported before anything about the
  // file. InvalidArgument: not absolute. NotFound: no such file. The message names `field`.
  absl::StatusOr<std::string> CheckInput(const std::string& field, const std::string& path) const;
  // The same for a folder that need not exist.
  absl::StatusOr<std::string> CheckOutput(const std::string& field, const std::string& path) const;

  const std::vector<std::string>& allowed() const { return allowed_; }

 private:
  absl::StatusOr<std::string> Canonical(const std::string& field, const std::string& path) const;

  std::vector<std::string> allowed_;  // canonical
};

}  // namespace weft
