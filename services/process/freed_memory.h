// What becomes of memory that a process frees.
#pragma once

namespace weft {

// Keeps up to 64 MiB of it for the next allocation, for programs that work and end. The C library would give
// arrays of a few MiB back and have the kernel clear them anew: a tenth of the time of `weft align`.
void KeepFreedMemory();

}  // namespace weft
