// Whole files in and out; nothing half-written ever stands under a final name.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// NotFound: no such file. PermissionDenied: not readable. InvalidArgument: not a file, or larger than
// `max_bytes`. The message names the file.
absl::StatusOr<std::string> ReadWholeFile(const std::string& path, uint64_t max_bytes = uint64_t{4} << 30);

// Writes to a temporary name in the same folder, flushes it to the disk and renames it. The folder must
// exist. NotFound, PermissionDenied, ResourceExhausted (disk full) or Unavailable; the message names file and
// remedy, and neither the file nor the temporary one is left behind.
absl::Status WriteFileAtomically(const std::string& path, std::string_view bytes);

// Makes the folder and its parents where they are missing. Errors as WriteFileAtomically.
absl::Status CreateFolders(const std::string& path);

}  // namespace weft
