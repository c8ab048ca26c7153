// Bodies on disk: JSON of weft.v1.Body (layout: docs/file-formats.md).
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "figure/skeleton.h"

namespace weft {

namespace v1 {
class Body;
}

struct NamedBody {
  std::string id;
  BodyShape shape;
};

// InvalidArgument names source_name and the field: unknown, no number, or a factor beyond its limits.
absl::StatusOr<NamedBody> ParseBody(std::string_view json, const std::string& source_name);

void BodyToProto(const NamedBody& body, v1::Body& proto);

// The same on files: errors of ReadWholeFile and WriteFileAtomically besides.
absl::StatusOr<NamedBody> ReadBody(const std::string& path);
absl::Status WriteBody(const std::string& path, const NamedBody& body);

// 16 hex digits over the factors; the id is no part of it.
std::string BodyHash(const BodyShape& shape);

}  // namespace weft
