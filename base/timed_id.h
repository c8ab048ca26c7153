// Names of things that are made one after the other.
#pragma once

#include <string>

namespace weft {

// "20261123-040506-1a2b3c4d": readable, sorted by time, and not to be guessed from another.
std::string NewTimedId();

}  // namespace weft
