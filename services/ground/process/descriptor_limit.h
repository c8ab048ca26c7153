// How many files and sockets a process may have open.
#pragma once

#include <cstdint>

namespace weft {

// The soft limit, which is in force.
int64_t DescriptorLimit();

// Raises the soft limit to the hard one, and returns what is in force then. Nothing of ours uses select(2),
// which is why limits are low.
int64_t RaiseDescriptorLimit();

}  // namespace weft
