// What a file system says of files.
#pragma once

#include <time.h>

#include <cstdint>
#include <string>

namespace weft {

// A time of stat() in ns since 1970.
int64_t UnixTime_ns(const timespec& time);

// The sizes of all files below a folder, as far as they can be seen: it may change meanwhile.
uint64_t BytesBelow(const std::string& folder);

}  // namespace weft
