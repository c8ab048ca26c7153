#include "services/ground/confinement/input_links.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int kDepth = 3;  // a dump has folders of frames, and a take that of its streams

// As the folder's listing says it: a call of stat per image would cost more than the search itself.
fs::file_type TypeOf(const fs::directory_entry& entry) {
  std::error_code error;
  if (entry.is_symlink(error)) return fs::file_type::symlink;
  if (entry.is_regular_file(error)) return fs::file_type::regular;
  if (entry.is_directory(error)) return fs::file_type::directory;
  return entry.symlink_status(error).type();
}

class LinkSearch {
 public:
  LinkSearch(const std::vector<std::string>& inputs, const LinkRules& rules)
      : inputs_(inputs), rules_(rules) {}

  void LookAt(const fs::path& path, fs::file_type type, int depth) {
    if (type == fs::file_type::symlink) {
      Follow(path, depth);
    } else if (type == fs::file_type::directory) {
      if (depth < kDepth) LookInto(path, depth);
    } else if (type != fs::file_type::regular && type != fs::file_type::not_found &&
               type != fs::file_type::none && found_.special.empty()) {
      found_.special = path.string();
    }
  }

  void LookBeside(const fs::path& json) {
    const LinksFound before = found_;
    std::error_code error;
    for (fs::directory_iterator it(json.parent_path(), error), end; !error && it != end;
         it.increment(error)) {
      const fs::file_type type = TypeOf(*it);
      if (type == fs::file_type::symlink) Follow(it->path(), kDepth);
      if (type == fs::file_type::regular) others_.insert(it->path().string());
    }
    found_ = before;  // most of them are none of its files
  }

  LinksFound Take() {
    found_.others.assign(others_.begin(), others_.end());
    return std::move(found_);
  }

 private:
  void LookInto(const fs::path& folder, int depth) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      LookAt(it->path(), TypeOf(*it), depth + 1);
    }
  }

  void Follow(const fs::path& link, int depth) {
    std::error_code error;
    const fs::path target = fs::canonical(link, error);
    if (error || Lies(target, inputs_)) return;
    const bool is_closed = !rules_.closed.empty() && (IsAtOrBelow(target.string(), rules_.closed) ||
                                                      IsAtOrBelow(rules_.closed, target.string()));
    if (is_closed || !Lies(target, rules_.allowed)) {
      if (found_.way_out.empty()) found_.way_out = link.string();
    } else if (others_.insert(target.string()).second) {
      LookAt(target, fs::status(target, error).type(), depth);
    }
  }

  static bool Lies(const fs::path& path, const std::vector<std::string>& folders) {
    return std::ranges::any_of(folders,
                               [&](const std::string& folder) { return IsAtOrBelow(path.string(), folder); });
  }

  const std::vector<std::string>& inputs_;
  const LinkRules& rules_;
  std::set<std::string> others_;
  LinksFound found_;
};

}  // namespace

bool IsAtOrBelow(const std::string& path, const std::string& folder) {
  const fs::path inner(path), outer(folder);
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

absl::StatusOr<UniqueFd> OpenWithoutLinks(const std::string& path) {
  if (path.empty() || path.front() != '/')
    return absl::InvalidArgumentError(absl::StrCat("\"", path, "\" is no absolute path"));
  constexpr int kFlags = O_PATH | O_NOFOLLOW | O_CLOEXEC;
  UniqueFd at(open("/", kFlags | O_DIRECTORY));
  std::string walked;
  const std::vector<std::string> parts = absl::StrSplit(path, '/', absl::SkipEmpty());
  for (size_t i = 0; at.open() && i < parts.size(); ++i) {
    absl::StrAppend(&walked, "/", parts[i]);
    UniqueFd next(openat(at.get(), parts[i].c_str(), kFlags));
    struct stat info;
    if (next.open() && fstat(next.get(), &info) == 0 && S_ISLNK(info.st_mode)) {
      return absl::FailedPreconditionError(absl::StrCat(
          walked, ": was exchanged for a symbolic link, which is not followed; remove the link"));
    }
    at = std::move(next);
  }
  if (at.open()) return at;
  const std::string message = absl::StrCat(walked, ": cannot be opened (", std::strerror(errno), ")");
  if (errno == ENOENT || errno == ENOTDIR) return absl::NotFoundError(message);
  if (errno == EMFILE || errno == ENFILE) return absl::ResourceExhaustedError(message);
  return absl::PermissionDeniedError(message);
}

LinksFound FindLinks(const std::vector<std::string>& inputs, const LinkRules& rules) {
  LinkSearch search(inputs, rules);
  for (const std::string& input : inputs) {
    std::error_code error;
    const fs::file_type type = fs::symlink_status(input, error).type();
    search.LookAt(input, type, 0);
    if (type == fs::file_type::regular && fs::path(input).extension() == ".json") search.LookBeside(input);
  }
  return search.Take();
}

}  // namespace weft
