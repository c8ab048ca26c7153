// A file that has its name only when it is whole.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

namespace weft {

// Writes all of `bytes` to an open descriptor. 0, or errno.
int WriteAll(int fd, std::string_view bytes);

enum class Flush { kToDisk, kLater };

// Writes `bytes` to "PATH.tmp.PROCESS.NUMBER", and renames that to `path`. 0, or errno; nothing is left
// behind then. A process that is killed leaves the temporary file: the next one that writes the same file
// removes it, for its writer's lock on it is gone. `mode` is the file's, less the process's umask.
int ReplaceWholeFile(const std::string& path, std::string_view bytes, mode_t mode = 0666,
                     Flush flush = Flush::kToDisk);

// Whether ReplaceWholeFile gives a file temporary names like `name`.
bool IsTemporaryName(std::string_view name);

}  // namespace weft
