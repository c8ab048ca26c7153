// GigE Vision's control protocol, as far as Weft speaks it itself; Aravis does the rest.
#pragma once

#include <cstdint>

namespace weft {

constexpr uint16_t kGvcpPort = 3956;  // UDP, of every camera

}  // namespace weft
