// Who calls the daemon.
#pragma once

#include <string>
#include <string_view>

#include "weft/v1/access.pb.h"

namespace weft {

struct Caller {
  // For people and the audit log: "token 0a1b2c3d4e5f (anna)", "certificate anna", "user weft". Empty: nobody
  // knows.
  std::string name;
  v1::Role role = v1::ROLE_UNSPECIFIED;
};

// By what shares and ownership count callers. Tokens of one name are one account, since names say whose
// tokens are, and tokens are replaced: "token anna". Other names are accounts by themselves.
std::string AccountOf(std::string_view caller_name);

// False where either is empty.
bool IsSameAccount(std::string_view caller_name, std::string_view other_name);

}  // namespace weft
