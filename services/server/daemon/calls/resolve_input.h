// Inputs that clients name, as paths of this machine.
#pragma once

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

// "take:ID", "job:ID", "library:NAME" of this kind of items, or a path, as a path that may be read. Errors
// name the field.
using ResolveInput = std::function<absl::StatusOr<std::string>(const std::string& field, v1::ItemKind item,
                                                               const std::string& value)>;

}  // namespace weft
