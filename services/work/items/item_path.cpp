#include "services/work/items/item_path.h"

#include <utility>
#include <vector>

#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/work/items/manifest.h"

namespace weft {

absl::StatusOr<PlaceInItem> FindPlace(const std::string& root, const std::string& path,
                                      ConfinedFolder::IfMissing missing) {
  WEFT_RETURN_IF_ERROR(CheckItemPath(path));
  absl::StatusOr<ConfinedFolder> folder = ConfinedFolder::Open(root);
  if (!folder.ok()) return folder.status();
  const std::vector<std::string> parts = absl::StrSplit(path, '/');
  for (size_t i = 0; i + 1 < parts.size(); ++i) {
    absl::StatusOr<ConfinedFolder> next = folder->Child(parts[i], missing);
    if (!next.ok()) return next.status();
    folder = std::move(next);
  }
  return PlaceInItem{*std::move(folder), parts.back()};
}

}  // namespace weft
