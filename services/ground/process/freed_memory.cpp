#include "services/ground/process/freed_memory.h"

#include <malloc.h>
#include <unistd.h>

#include <fstream>

namespace weft {

size_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  size_t total_pages = 0, resident_pages = 0;
  file >> total_pages >> resident_pages;
  return resident_pages * static_cast<size_t>(getpagesize());
}

void KeepFreedMemory() {
  constexpr int kMib = 1 << 20;
  mallopt(M_TRIM_THRESHOLD, 64 * kMib);
  mallopt(M_MMAP_THRESHOLD, 32 * kMib);  // the most that it takes; setting the other one would leave 128 KiB
  mallopt(M_TOP_PAD, 4 * kMib);
}

void FreedMemory::Requeue() {
  if (ResidentBytes() < resident_bytes_ + kWorthwhile_bytes) return;
  malloc_trim(0);
  resident_bytes_ = ResidentBytes();
}

}  // namespace weft
