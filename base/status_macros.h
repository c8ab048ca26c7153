// Errors handed on to the caller, in functions that return absl::Status or absl::StatusOr.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

// WEFT_RETURN_IF_ERROR(Write(path)): returns what the expression, an absl::Status, says, unless it is OK.
#define WEFT_RETURN_IF_ERROR(...) WEFT_RETURN_IF_ERROR_(WEFT_STATUS_NAME_(status_, __LINE__), __VA_ARGS__)

// WEFT_ASSIGN_OR_RETURN(const Mesh mesh, ReadMesh(path)): declares, or assigns to, what is in the
// absl::StatusOr, or returns its status. A type with a comma in it is written `auto`.
#define WEFT_ASSIGN_OR_RETURN(target, ...) \
  WEFT_ASSIGN_OR_RETURN_(WEFT_STATUS_NAME_(status_or_, __LINE__), target, __VA_ARGS__)

#define WEFT_RETURN_IF_ERROR_(name, ...)                            \
  do {                                                              \
    if (absl::Status name = (__VA_ARGS__); !name.ok()) return name; \
  } while (false)

#define WEFT_ASSIGN_OR_RETURN_(name, target, ...)  \
  auto name = (__VA_ARGS__);                       \
  if (!name.ok()) return std::move(name).status(); \
  target = *std::move(name)

#define WEFT_STATUS_NAME_(prefix, line) WEFT_STATUS_NAME_OF_LINE_(prefix, line)
#define WEFT_STATUS_NAME_OF_LINE_(prefix, line) prefix##line
