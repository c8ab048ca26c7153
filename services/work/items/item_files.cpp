#include "services/work/items/item_files.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/garment_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/items/manifest.h"
#include "services/work/items/sha256.h"
#include "weft/v1/board.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

using Names = std::vector<std::string>;  // below the folder

// board.json and the images that it names.
absl::StatusOr<Names> NamesOfBoard(const fs::path& json) {
  v1::Board board;
  WEFT_RETURN_IF_ERROR(ReadJsonFile(json.string(), board));
  Names names = {json.filename().string()};
  names.push_back(board.image().empty() ? "board.png" : board.image());
  if (!board.panels().empty()) names.push_back(board.panels());
  return names;
}

absl::StatusOr<Names> NamesBelow(const fs::path& folder) {
  Names names;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    const fs::file_status kind = entry->symlink_status(ignored);
    if (fs::is_directory(kind)) continue;
    if (!fs::is_regular_file(kind)) {
      return absl::InvalidArgumentError(
          absl::StrCat(entry->path().string(),
                       ": is no plain file, and links are not uploaded; put a copy of the file there"));
    }
    names.push_back(entry->path().lexically_relative(folder).generic_string());
    if (names.size() > kMaxItemFiles) {
      return absl::InvalidArgumentError(
          absl::StrCat(folder.string(), ": more than ", kMaxItemFiles,
                       " files; upload a part of them, e.g. of `weft take copy`"));
    }
  }
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat(folder.string(), ": cannot be listed (", error.message(), ")"));
  }
  if (names.empty()) return absl::InvalidArgumentError(absl::StrCat(folder.string(), ": holds no file"));
  return names;
}

// OBJ lists materials and pictures beside it, which no mesh needs.
absl::StatusOr<Names> MeshesBelow(const fs::path& folder) {
  WEFT_ASSIGN_OR_RETURN(Names names, NamesBelow(folder));
  std::erase_if(names, [](const std::string& name) { return !IsMeshName(name); });
  if (!names.empty()) return names;
  return absl::InvalidArgumentError(absl::StrCat(
      folder.string(), ": holds no .obj or .ply; give the mesh of a garment, or a folder of them"));
}

absl::StatusOr<Names> ChooseNames(v1::ItemKind kind, const fs::path& path, fs::path* folder) {
  if (!PathExists(path)) return absl::NotFoundError(absl::StrCat(path.string(), ": no such file"));
  const bool is_folder = IsFolder(path);
  *folder = is_folder ? path : path.parent_path();
  if (kind == v1::ITEM_KIND_BOARD) {
    if (is_folder) return NamesOfBoard(path / "board.json");
    if (path.extension() == ".json") return NamesOfBoard(path);
  }
  if (kind == v1::ITEM_KIND_TEMPLATE && !is_folder) return NamesBelow(*folder);
  if (kind == v1::ITEM_KIND_GARMENT && is_folder) return MeshesBelow(path);
  if (kind == v1::ITEM_KIND_RIG && is_folder) {
    return absl::InvalidArgumentError(absl::StrCat(path.string(), ": is a folder; give the rig.json in it"));
  }
  if (kind == v1::ITEM_KIND_DUMP && !is_folder) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(), ": is a file; give the folder of the dump"));
  }
  if (kind == v1::ITEM_KIND_AVATAR && !is_folder) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(), ": is a file; give the folder of the avatar"));
  }
  return is_folder ? NamesBelow(path) : Names{path.filename().string()};
}

}  // namespace

absl::StatusOr<LocalItem> ListLocalItem(v1::ItemKind kind, const std::string& path,
                                        const std::function<void(uint64_t done, uint64_t total)>& hashed) {
  fs::path folder;
  WEFT_ASSIGN_OR_RETURN(Names names, ChooseNames(kind, fs::absolute(path).lexically_normal(), &folder));
  std::ranges::sort(names);
  LocalItem item;
  uint64_t total = 0, done = 0;
  for (const std::string& name : names) {
    WEFT_RETURN_IF_ERROR(CheckItemPath(name));
    item.paths.push_back((folder / name).string());
    std::error_code error;
    v1::ItemFile& file = *item.manifest.add_files();
    file.set_path(name);
    file.set_bytes(static_cast<int64_t>(fs::file_size(item.paths.back(), error)));
    if (error) return absl::NotFoundError(absl::StrCat(item.paths.back(), ": ", error.message()));
    total += static_cast<uint64_t>(file.bytes());
  }
  for (size_t i = 0; i < item.paths.size(); ++i) {
    WEFT_ASSIGN_OR_RETURN(const std::string hash, Sha256OfFile(item.paths[i], [&](size_t bytes) {
                            done += bytes;
                            if (hashed) hashed(std::min(done, total), total);
                          }));
    item.manifest.mutable_files(static_cast<int>(i))->set_sha256(hash);
  }
  return item;
}

}  // namespace weft
