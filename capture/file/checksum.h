// The checksum of everything that a take stores.
#pragma once

#include <cstddef>
#include <cstdint>

namespace weft {

// XXH3 with 64 bits and seed 0: finds damage, not malice. The same on every machine.
uint64_t Checksum(const void* bytes, size_t size);

}  // namespace weft
