#include "capture/file/checksum.h"

#include <xxhash.h>

namespace weft {

uint64_t Checksum(const void* bytes, size_t size) { return XXH3_64bits(bytes, size); }

}  // namespace weft
