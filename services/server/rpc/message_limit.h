// How large messages to a daemon may be.
#pragma once

namespace weft {

// A daemon reads a larger one whole, refuses it, and ends connections that send much more before it can say
// why; so clients keep to it themselves.
inline constexpr int kLargestRequest_bytes = 1 << 20;

}  // namespace weft
