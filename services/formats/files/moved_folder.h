// Folders that move, or go, as a whole.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace weft {

// A rename that a power failure does not undo. Makes the parents of `to` where they are missing. Errors of
// WriteError.
absl::Status MoveFolder(const std::string& from, const std::string& to);

// How a folder goes: first to "<prefix><name>" beside it, which no reader knows, so that a kill leaves no
// half of it under its name. In place of what an earlier removal left there. OK: there is none. Errors of
// MoveFolder.
absl::Status PutAside(const std::string& folder, const std::string& prefix);

// Removes what was put aside in this folder, by whichever process. The first error, after all were tried.
absl::Status RemoveAside(const std::string& parent, const std::string& prefix);

}  // namespace weft
