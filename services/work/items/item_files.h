// The files on this machine that make an item.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

struct LocalItem {
  v1::ItemManifest manifest;
  std::vector<std::string> paths;  // where each file of the manifest lies
};

// Lists and hashes what `path` holds: a rig.json; a board.json with its images, its folder, or a board.png;
// the folder of a template or its template.json; the folder of a dump; the folder of an avatar; a garment's
// OBJ or PLY, or those in a folder. `hashed` is called with the bytes read and all of them. NotFound,
// InvalidArgument (links, names that no item may have) or errors of reading; the file is named.
absl::StatusOr<LocalItem> ListLocalItem(
    v1::ItemKind kind, const std::string& path,
    const std::function<void(uint64_t done, uint64_t total)>& hashed = {});

}  // namespace weft
