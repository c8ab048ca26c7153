#include "services/process/freed_memory.h"

#include <malloc.h>

namespace weft {

void KeepFreedMemory() {
  constexpr int kMib = 1 << 20;
  mallopt(M_TRIM_THRESHOLD, 64 * kMib);
  mallopt(M_MMAP_THRESHOLD, 32 * kMib);  // the most that it takes; setting the other one would leave 128 KiB
  mallopt(M_TOP_PAD, 4 * kMib);
}

}  // namespace weft
