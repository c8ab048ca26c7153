// Kinds of work as text of the message weft.v1.WorkKindInfo. Only for kind_info.cpp.
#pragma once

namespace weft {

extern const char* const kJobKinds[2];
extern const char* const kOperationKinds[9];

}  // namespace weft
