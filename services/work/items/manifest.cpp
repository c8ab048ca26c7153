#include "services/work/items/manifest.h"

#include <algorithm>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/work/items/item_words.h"
#include "services/work/items/sha256.h"

namespace weft {
namespace {

constexpr size_t kMaxItemPathBytes = 1024, kMaxPartBytes = 200, kMaxItemDepth = 8;
constexpr int64_t kMaxItemBytes = int64_t{1} << 50;

absl::Status BadFile(const std::string& path, const std::string& why) {
  constexpr size_t kShown = 200;
  return absl::InvalidArgumentError(
      absl::StrCat("manifest.files: \"", EscapedText(path.substr(0, kShown)), "\" ", why));
}

absl::Status CheckTree(const std::set<std::string>& paths) {
  for (const std::string& path : paths) {
    for (size_t slash = path.find('/'); slash != std::string::npos; slash = path.find('/', slash + 1)) {
      if (paths.contains(path.substr(0, slash)))
        return BadFile(path.substr(0, slash), "is a file and a folder");
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckItemPath(const std::string& path) {
  if (path.empty()) return BadFile(path, "must not be empty");
  if (path.front() == '/') return BadFile(path, "is absolute; give the path below the item's folder");
  if (path.size() > kMaxItemPathBytes) {
    return BadFile(path,
                   absl::StrCat("has ", path.size(), " bytes, at most ", kMaxItemPathBytes, " are allowed"));
  }
  if (!IsPlainText(path)) return BadFile(path, "must be UTF-8 without control characters");
  const std::vector<std::string> parts = absl::StrSplit(path, '/');
  if (parts.size() > kMaxItemDepth) {
    return BadFile(
        path, absl::StrCat("lies ", parts.size(), " folders deep, at most ", kMaxItemDepth, " are allowed"));
  }
  for (const std::string& part : parts) {
    if (part.empty() || part == "." || part == "..")
      return BadFile(path, "holds an empty name, \".\" or \"..\"");
    if (part.size() > kMaxPartBytes) {
      return BadFile(path, absl::StrCat("has a name of more than ", kMaxPartBytes, " bytes"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckManifest(const v1::ItemManifest& manifest) {
  if (manifest.files().empty()) return absl::InvalidArgumentError("manifest.files: must not be empty");
  if (manifest.files_size() > kMaxItemFiles) {
    return absl::InvalidArgumentError(absl::StrCat("manifest.files: ", manifest.files_size(),
                                                   " files, at most ", kMaxItemFiles, " are allowed"));
  }
  std::set<std::string> paths;
  int64_t total = 0;
  for (const v1::ItemFile& file : manifest.files()) {
    WEFT_RETURN_IF_ERROR(CheckItemPath(file.path()));
    if (file.bytes() < 0 || file.bytes() > kMaxItemBytes - total) {
      return BadFile(file.path(), absl::StrCat("has an impossible size, ", file.bytes(), " bytes"));
    }
    total += file.bytes();
    if (!IsSha256(file.sha256())) return BadFile(file.path(), "needs a sha256 of 64 lower-case hex digits");
    if (!paths.insert(file.path()).second) return BadFile(file.path(), "is given twice");
  }
  return CheckTree(paths);
}

std::string ItemIdOf(const v1::ItemManifest& manifest) {
  std::vector<const v1::ItemFile*> files;
  for (const v1::ItemFile& file : manifest.files()) files.push_back(&file);
  std::ranges::sort(files,
                    [](const v1::ItemFile* a, const v1::ItemFile* b) { return a->path() < b->path(); });
  Sha256 hash;
  for (const v1::ItemFile* file : files) {
    hash.Add(absl::StrCat(file->sha256(), " ", file->bytes(), " ", file->path(), "\n"));
  }
  return hash.Hex();
}

int64_t BytesOf(const v1::ItemManifest& manifest) {
  int64_t bytes = 0;
  for (const v1::ItemFile& file : manifest.files()) bytes += file.bytes();
  return bytes;
}

const v1::ItemFile* FindFile(const v1::ItemManifest& manifest, const std::string& path) {
  const auto found =
      std::ranges::find_if(manifest.files(), [&](const v1::ItemFile& file) { return file.path() == path; });
  return found == manifest.files().end() ? nullptr : &*found;
}

}  // namespace weft
