// Whole files in and out; nothing half-written ever stands under a final name.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/whole_file.h"

namespace weft {

// NotFound: no such file. PermissionDenied: not readable. InvalidArgument: not a file, or larger than
// `max_bytes`. The message names the file.
absl::StatusOr<std::string> ReadWholeFile(const std::string& path, uint64_t max_bytes = uint64_t{4} << 30);

// The same of a file that is open at its beginning; `path` is for messages.
absl::StatusOr<std::string> ReadOpenFile(int fd, const std::string& path,
                                         uint64_t max_bytes = uint64_t{4} << 30);

// Writes to a temporary name in the same folder, flushes it to the disk, renames it and flushes the folder,
// so that the file survives a power failure. The folder must exist. NotFound, PermissionDenied,
// ResourceExhausted (disk full) or Unavailable; the message names file and remedy, and the temporary file is
// not left behind. A killed process leaves it, and the next that writes to the folder removes it. After an
// error of the last flush the new file stands, and may be lost in a power failure. `mode` is the file's, less
// the process's umask.
absl::Status WriteFileAtomically(const std::string& path, std::string_view bytes, mode_t mode = 0666);

// The bytes of one file under another name, which is written as above; it gets the mode of a new file. Errors
// of ReadWholeFile and WriteFileAtomically.
absl::Status CopyWholeFile(const std::string& from, const std::string& to);

// Whether WriteFileAtomically gives the file `file` temporary names like `name`.
bool IsTemporaryNameOf(std::string_view name, std::string_view file);

// Makes the folder and its parents where they are missing, flushed to the disk. Errors as
// WriteFileAtomically.
absl::Status CreateFolders(const std::string& path);

// Flushes an open folder: names made, replaced and removed in it so far are on the disk. Unavailable names
// `path`.
absl::Status SyncFolder(int fd, const std::string& path);

// The status of a file that cannot be written, by errno.
absl::Status WriteError(const std::string& path, int error);

}  // namespace weft
