// The text part of a PLY file.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "services/formats/files/ply.h"

namespace weft {

enum class PlyFormat : uint8_t { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  Ply layout;             // elements with rows and properties, without values
  size_t body_begin = 0;  // first byte after the header
};

// Bytes of one value.
int PlyTypeSize(PlyType type);

// InvalidArgument names source_name and the line.
absl::StatusOr<PlyHeader> ParsePlyHeader(std::string_view bytes, const std::string& source_name);

// The header of a binary little-endian file.
std::string WritePlyHeader(const Ply& ply);

}  // namespace weft
