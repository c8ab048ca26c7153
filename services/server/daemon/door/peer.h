// Who is at the other end of a connection.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace weft {

struct Peer {
  std::string name;  // for people and limits: "user anna", "10.0.0.5" or "2001:db8:1:2::/64" (network.h)
  std::optional<uid_t> uid;  // of a user of this machine, as the kernel says it

  bool operator==(const Peer&) const = default;
};

// Of a connected socket. Loopback connections belong to a user as well: sock_diag(7) tells whose socket the
// other end is.
Peer PeerOf(int socket);

// The user's name where it is the one that this process runs as, or root; otherwise empty.
std::string TrustedUserOf(const Peer& peer);

}  // namespace weft
