#include "services/server/access/role_words.h"

#include "absl/strings/str_cat.h"
#include "services/formats/files/enum_words.h"

namespace weft {

const char* RoleWord(v1::Role role) { return EnumWord(role, "nobody"); }

absl::StatusOr<v1::Role> ParseRole(const std::string& word) {
  for (const v1::Role role : {v1::ROLE_VIEWER, v1::ROLE_CLIENT, v1::ROLE_OPERATOR, v1::ROLE_ADMIN}) {
    if (word == RoleWord(role)) return role;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("role: \"", word, "\" is not viewer, client, operator or admin"));
}

}  // namespace weft
