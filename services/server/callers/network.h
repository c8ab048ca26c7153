// Machines that count as one.
#pragma once

#include <string>
#include <string_view>

namespace weft {

// By what limits count a peer's address: IPv4 as it is, also where it is mapped into IPv6 (RFC
// 4291, 2.5.5.2); of IPv6 the network, "2001:db8:1:2::/64", since whoever has one of its addresses has all
// 2^64 (RFC 4291, 2.5.4). The loopback address and what is no address stay as they are.
std::string NetworkOf(std::string_view address);

}  // namespace weft
