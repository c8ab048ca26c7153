// Errors that say what they are about.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/error_reason.h"

namespace weft {

// The error with a name before its message: "rig.json: no such file". OK stays what it is.
inline absl::Status Naming(absl::string_view what, const absl::Status& status) {
  if (status.ok()) return status;
  return WithMessage(status, absl::StrCat(what, ": ", status.message()));
}

template <typename Value>
absl::StatusOr<Value> Naming(absl::string_view what, absl::StatusOr<Value> result) {
  if (result.ok()) return result;
  return Naming(what, result.status());
}

}  // namespace weft
