#include "services/server/callers/network.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <array>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace weft {

std::string NetworkOf(std::string_view address) {
  // "fe80::1%eth0" has a zone.
  const std::string text(address.substr(0, address.find('%')));
  in6_addr v6{};
  if (inet_pton(AF_INET6, text.c_str(), &v6) != 1 || IN6_IS_ADDR_LOOPBACK(&v6)) return std::string(address);
  std::array<char, INET6_ADDRSTRLEN> written{};
  if (IN6_IS_ADDR_V4MAPPED(&v6)) return inet_ntop(AF_INET, &v6.s6_addr[12], written.data(), written.size());
  constexpr size_t kNetworkBytes = 8;
  std::memset(&v6.s6_addr[kNetworkBytes], 0, sizeof v6 - kNetworkBytes);
  return absl::StrCat(inet_ntop(AF_INET6, &v6, written.data(), written.size()), "/64");
}

}  // namespace weft
