#include "services/server/daemon/calls/path_policy.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/rpc/error_detail.h"

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

// Takes and results are for clients, of which those on this machine may know the path.
bool IsClosed(const fs::path& path, const std::string& state_folder, bool is_input) {
  if (state_folder.empty()) return false;
  if (is_input && LiesBelow(state_folder, path)) return true;
  if (!LiesBelow(path, state_folder)) return false;
  return !is_input || !(LiesBelow(path, fs::path(state_folder) / "takes") ||
                        LiesBelow(path, fs::path(state_folder) / "results"));
}

absl::Status ClosedError(const std::string& field, const std::string& path, const std::string& state_folder) {
  return FieldError(
      absl::StatusCode::kPermissionDenied,
      {field, absl::StrCat(path, " is in the daemon's own folder, ", state_folder, ", or contains it"),
       "choose another one"});
}

}  // namespace

bool LiesBelow(const fs::path& path, const fs::path& folder) {
  return IsAtOrBelow(path.string(), folder.string());
}

absl::StatusOr<PathPolicy> PathPolicy::Create(const std::vector<std::string>& allowed,
                                              const std::string& state_folder) {
  if (allowed.empty()) return absl::InvalidArgumentError("--allow-path: give at least one folder");
  PathPolicy policy;
  policy.state_folder_ = state_folder;
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
  const bool inside = !error && std::ranges::any_of(allowed_, [&](const std::string& folder) {
    return LiesBelow(canonical, folder);
  });
  if (inside) return canonical.string();
  return FieldError(absl::StatusCode::kPermissionDenied,
                    {field,
                     absl::StrCat(path, " lies outside the folders that the daemon may use (",
                                  absl::StrJoin(allowed_, ", "), ")"),
                     "move it there, or start weftd with another --allow-path"});
}

absl::Status PathPolicy::CheckLinks(const std::string& field, const std::string& input) const {
  const LinksFound found = FindLinks({input}, links());
  if (!found.way_out.empty()) {
    return FieldError(absl::StatusCode::kPermissionDenied,
                      {field,
                       absl::StrCat(EscapedText(found.way_out),
                                    " is a link that leads out of the folders that the daemon may use (",
                                    absl::StrJoin(allowed_, ", "), ")"),
                       "put the file there instead of the link, or start weftd with another --allow-path"});
  }
  if (found.special.empty()) return absl::OkStatus();
  return FieldError(
      absl::StatusCode::kInvalidArgument,
      {field, absl::StrCat(EscapedText(found.special), " is a FIFO, device or socket, which is not read"),
       "remove it, or put a file in its place"});
}

std::vector<std::string> PathPolicy::AllowedButState() const {
  std::vector<std::string> folders;
  std::vector<fs::path> left(allowed_.begin(), allowed_.end());
  while (!left.empty()) {
    const fs::path folder = left.back();
    left.pop_back();
    if (state_folder_.empty() || (!LiesBelow(state_folder_, folder) && !LiesBelow(folder, state_folder_))) {
      folders.push_back(folder.string());
    } else if (LiesBelow(state_folder_, folder) && folder != state_folder_) {
      std::error_code error;
      for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
        std::error_code gone;
        if (!it->is_symlink(gone)) left.push_back(it->path());
      }
    }
  }
  return folders;
}

absl::StatusOr<std::string> PathPolicy::CheckInput(const std::string& field, const std::string& path) const {
  WEFT_ASSIGN_OR_RETURN(std::string canonical, CheckInputPath(field, path));
  WEFT_RETURN_IF_ERROR(CheckLinks(field, canonical));
  return canonical;
}

absl::StatusOr<std::string> PathPolicy::CheckInputPath(const std::string& field,
                                                       const std::string& path) const {
  WEFT_ASSIGN_OR_RETURN(std::string canonical, Canonical(field, path));
  if (!PathExists(canonical)) {
    return FieldError(absl::StatusCode::kNotFound,
                      {field, absl::StrCat(path, ": no such file on the daemon's machine"), "copy it there"});
  }
  if (IsClosed(canonical, state_folder_, true)) return ClosedError(field, path, state_folder_);
  return canonical;
}

absl::StatusOr<std::string> PathPolicy::CheckOutput(const std::string& field, const std::string& path) const {
  WEFT_ASSIGN_OR_RETURN(std::string canonical, Canonical(field, path));
  if (IsClosed(canonical, state_folder_, false)) return ClosedError(field, path, state_folder_);
  if (!state_folder_.empty() && LiesBelow(state_folder_, canonical)) {
    return FieldError(absl::StatusCode::kInvalidArgument,
                      {field, absl::StrCat(path, " contains the daemon's own folder, ", state_folder_),
                       "choose another one"});
  }
  if (PathExists(canonical) && !IsFolder(canonical)) {
    return FieldError(absl::StatusCode::kInvalidArgument,
                      {field, absl::StrCat(path, " is a file"), "give a folder"});
  }
  return canonical;
}

}  // namespace weft
