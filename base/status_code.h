// Status codes by the names that absl gives them.
#pragma once

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace weft {

// kInternal: no code has this name.
inline absl::StatusCode StatusCodeOf(absl::string_view name) {
  for (int code = 1; code <= static_cast<int>(absl::StatusCode::kUnauthenticated); ++code) {
    if (absl::StatusCodeToString(static_cast<absl::StatusCode>(code)) == name)
      return static_cast<absl::StatusCode>(code);
  }
  return absl::StatusCode::kInternal;
}

}  // namespace weft
