// Kinds, names and references of items, in words.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

// Before the name of an item where a path could stand.
inline constexpr char kLibraryPrefix[] = "library:";

// "rig", "board", "template", "dump", "avatar" or "garment"; also the folder of the kind.
const char* ItemKindWord(v1::ItemKind kind);
// InvalidArgument: none of these words.
absl::StatusOr<v1::ItemKind> ParseItemKind(const std::string& word);
// InvalidArgument: no kind.
absl::Status CheckItemKind(v1::ItemKind kind);

// InvalidArgument names `name`: not letters, digits, ".", "_", "-", or too long.
absl::Status CheckItemName(const std::string& name);
// A name for what lies at `path`: that of the file without its ending, or of the folder.
std::string ItemNameOfPath(const std::string& path);

// 64 lower hex digits?
bool IsSha256(const std::string& text);

// Which item is asked for: an id, or a name with or without a version.
struct ItemReference {
  std::string id;
  std::string name;
  std::optional<int> version;
};
// From NAME, NAME@VERSION or sha256:HEX. InvalidArgument: none of them.
absl::StatusOr<ItemReference> ParseItemReference(const std::string& text);

}  // namespace weft
