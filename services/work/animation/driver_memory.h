// What a driver knows of the frames so far, as bytes of a frame's report (layout: docs/file-formats.md).
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "animation/sparse_view/sparse_view_driver.h"

namespace weft {

// The same bytes for the same memory; none for that of a driver before its first frame. Without the mesh,
// which is the frame's result.
std::string EncodeMemory(const DriverMemory& memory);

// Exactly what was encoded; the mesh is empty. InvalidArgument for bytes of another layout.
absl::StatusOr<DriverMemory> DecodeMemory(std::string_view bytes);

// 16 hex digits that tell memories apart.
std::string MemoryChecksum(std::string_view bytes);

}  // namespace weft
