// Roles in words.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/access.pb.h"

namespace weft {

// "viewer", "client", "operator" or "admin"; "nobody" for none.
const char* RoleWord(v1::Role role);
// InvalidArgument: none of these words.
absl::StatusOr<v1::Role> ParseRole(const std::string& word);

}  // namespace weft
