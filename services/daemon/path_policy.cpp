#include "services/daemon/path_policy.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "services/rpc/error_detail.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Resolves every link of the part that exists. A link to nowhere could become a way out later, so it is an
// error.
fs::path Resolve(const fs::path& path, std::error_code& error) {
  const fs::path resolved = fs::weakly_canonical(path, error);
  if (error) return {};
  fs::path walked;
  for (const fs::path& part : resolved) {
    walked /= part;
    std::error_code ignored;
    if (fs::is_symlink(fs::symlink_status(walked, ignored))) {
      error = std::make_error_code(std::errc::too_many_symbolic_link_levels);
      return {};
    }
  }
  return resolved;
}

}  // namespace

bool LiesBelow(const fs::path& path, const fs::path& folder) {
  const auto [folder_end, ignored] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return folder_end == folder.end();
}

absl::StatusOr<PathPolicy> PathPolicy::Create(const std::vector<std::string>& allowed) {
  if (allowed.empty()) return absl::InvalidArgumentError("--allow-path: give at least one folder");
  PathPolicy policy;
  for (const std::string& path : allowed) {
    std::error_code error;
    const fs::path canonical = fs::canonical(path, error);
    if (error || !fs::is_directory(canonical, error)) {
      return absl::InvalidArgumentError(absl::StrCat("--allow-path: ", path, " is no folder"));
    }
    policy.allowed_.push_back(canonical.string());
  }
  return policy;
}

absl::StatusOr<std::string> PathPolicy::Canonical(const std::string& field, const std::string& path) const {
  if (path.empty() || path.front() != '/') {
    return FieldError(absl::StatusCode::kInvalidArgument,
                      {field, absl::StrCat("\"", path, "\" is not absolute"),
                       "give the path from the root of the daemon's machine"});
  }
  std::error_code error;
  const fs::path canonical = Resolve(path, error);
  const bool inside = !error && std::any_of(allowed_.begin(), allowed_.end(), [&](const std::string& folder) {
    return LiesBelow(canonical, folder);
  });
  if (inside) return canonical.string();
  return FieldError(absl::StatusCode::kPermissionDenied,
                    {field,
                     absl::StrCat(path, " lies outside the folders that the daemon may use (",
                                  absl::StrJoin(allowed_, ", "), ")"),
                     "move it there, or start weftd with another --allow-path"});
}

absl::StatusOr<std::string> PathPolicy::CheckInput(const std::string& field, const std::string& path) const {
  absl::StatusOr<std::string> canonical = Canonical(field, path);
  if (!canonical.ok()) return canonical;
  std::error_code error;
  if (!fs::exists(*canonical, error)) {
    return FieldError(absl::StatusCode::kNotFound,
                      {field, absl::StrCat(path, ": no such file on the daemon's machine"), "copy it there"});
  }
  return canonical;
}

absl::StatusOr<std::string> PathPolicy::CheckOutput(const std::string& field, const std::string& path) const {
  absl::StatusOr<std::string> canonical = Canonical(field, path);
  if (!canonical.ok()) return canonical;
  std::error_code error;
  if (fs::exists(*canonical, error) && !fs::is_directory(*canonical, error)) {
    return FieldError(absl::StatusCode::kInvalidArgument,
                      {field, absl::StrCat(path, " is a file"), "give a folder"});
  }
  return canonical;
}

}  // namespace weft
