// The least role that each method asks for.
#pragma once

#include <string>

#include "weft/v1/access.pb.h"

namespace weft {

// Of a method by its path, "/weft.v1.Takes/StartTake", as the option `role` of the schemas says it. Anybody
// may ask for health (ROLE_UNSPECIFIED). Reflection is a viewer's, and so is what no schema knows. A method
// of ours without the option is an administrator's.
v1::Role RoleOfMethod(const std::string& path);

}  // namespace weft
