// Files of an item below its folder, reached without following links.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "services/formats/files/confined_folder.h"

namespace weft {

// A folder and a name in it.
struct PlaceInItem {
  ConfinedFolder folder;
  std::string name;
};

// Where `path` (CheckItemPath) lies below `root`. Errors of ConfinedFolder and CheckItemPath.
absl::StatusOr<PlaceInItem> FindPlace(const std::string& root, const std::string& path,
                                      ConfinedFolder::IfMissing missing);

}  // namespace weft
