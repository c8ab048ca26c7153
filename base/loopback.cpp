#include "base/loopback.h"

#include <arpa/inet.h>

namespace weft {

bool IsLoopbackHost(const std::string& host) {
  constexpr unsigned kLoopback = 127;
  in_addr address = {};
  return host == "localhost" || host == "[::1]" ||
         (inet_pton(AF_INET, host.c_str(), &address) == 1 && ntohl(address.s_addr) >> 24 == kLoopback);
}

}  // namespace weft
