// Symbolic links among inputs: where they lead, and whether they may.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// Whether `path` is `folder` or lies below it. Both are without links.
bool IsAtOrBelow(const std::string& path, const std::string& folder);

// Opens (O_PATH) an absolute path, folder by folder, and follows no link, so names that are exchanged
// meanwhile lead nowhere. NotFound. FailedPrecondition: a link is in it; it is named.
absl::StatusOr<UniqueFd> OpenWithoutLinks(const std::string& path);

// Folders without links.
struct LinkRules {
  std::vector<std::string> allowed;  // links may lead there
  std::string closed;                // but not there; empty: no such folder
};

struct LinksFound {
  std::vector<std::string> others;  // outside of the inputs, and read with them; without links
  std::string way_out;              // the first link that leads elsewhere; empty: none
  std::string special;              // the first FIFO, device or socket; empty: none
};

// Looks through `inputs`, which are without links, and three folders deep below them. Others are what links
// lead to, and the files beside a JSON file, which may name them. Links to nowhere are passed over. What
// cannot be read is left to whoever reads it.
LinksFound FindLinks(const std::vector<std::string>& inputs, const LinkRules& rules);

}  // namespace weft
