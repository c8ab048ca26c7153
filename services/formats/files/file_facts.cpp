#include "services/formats/files/file_facts.h"

#include <filesystem>
#include <system_error>

namespace weft {

int64_t UnixTime_ns(const timespec& time) { return int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec; }

uint64_t BytesBelow(const std::string& folder) {
  uint64_t bytes = 0;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code fault;
    const uintmax_t size = entry->is_regular_file(fault) ? entry->file_size(fault) : 0;
    if (!fault) bytes += size;
  }
  return bytes;
}

}  // namespace weft
