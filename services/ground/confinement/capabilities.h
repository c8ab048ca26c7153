// What a process of root may do beyond its user's rights.
#pragma once

namespace weft {

// The calling thread, and programs that it runs as root, keep of their capabilities those that concern files
// alone: to read, write and search those of others. No other limits, users, clocks or devices are theirs from
// then on. False: the kernel refuses; errno says why.
bool KeepFileCapabilities();

}  // namespace weft
