// Errors of requests that say which field is wrong and what to do.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "weft/v1/error.pb.h"

namespace weft {

struct FieldProblem {
  std::string field;    // of the request, e.g. "spec.rig"
  std::string problem;  // e.g. "/a/rig.json: no such file"
  std::string remedy;   // e.g. "copy it there"; may be empty
};

// The message is "FIELD: PROBLEM; REMEDY". ToGrpcStatus hands field and remedy on as an ErrorDetail.
absl::Status FieldError(absl::StatusCode code, const FieldProblem& what);

// Field and remedy of an error, here or as a client got it. None: the error has only its message.
std::optional<v1::ErrorDetail> DetailOf(const absl::Status& status);

}  // namespace weft
